"""The engines that the benchmarks time, each checked for soundness first."""
