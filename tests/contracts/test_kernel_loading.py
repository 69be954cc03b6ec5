"""What compiles is told once, and from the second time on with how long it took."""

import logging
from pathlib import Path
from threading import get_ident

import pytest
import warp as wp

from tendon_newton.device_code import kernel_loading
from tendon_newton.device_code.kernel_loading import load_kernels


def kernels_of(number: int) -> list[wp.Kernel]:
    """Return two kernels that nobody compiled, unless of the same number."""

    def filled(values: wp.array[float]) -> None:
        values[wp.tid()] = wp.static(float(number))

    return [
        wp.kernel(filled, name=f"{name}_kernel_{number}", module="unique", enable_backward=False)
        for name in ("rollout", "settle")
    ]


def test_what_compiles_is_told(tmp_path, monkeypatch, caplog) -> None:
    """First the kernels, then each that is done; a later run says how long that took."""
    wp.init()
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))
    monkeypatch.setenv("TENDON_NEWTON_THREADS", "2")
    caplog.set_level(logging.INFO)
    kernels = kernels_of(1)
    load_kernels(kernels, "cpu")
    first, *done = caplog.messages
    assert first == (
        "compiling 2 kernels (1 x rollout, 1 x settle) on 2 cores, once on this computer"
    )
    assert [line[:16] for line in done] == ["compiled 1 of 2 ", "compiled 2 of 2 "]
    caplog.clear()
    load_kernels(kernels, "cpu")
    assert caplog.messages == []
    load_kernels(kernels_of(2), "cpu")
    assert caplog.messages[0].startswith(f"{first}; the last such took ")


def test_a_kernel_that_came_along_is_not_compiled(tmp_path, monkeypatch, caplog) -> None:
    """It is put into Warp's cache, which need not exist yet, and launched from there."""
    wp.init()
    caplog.set_level(logging.INFO)
    kernels = kernels_of(4)
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "brought"))
    load_kernels(kernels, "cpu")
    caplog.clear()
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "empty"))
    monkeypatch.setattr(kernel_loading, "BROUGHT", tmp_path / "brought")
    for kernel in kernels:
        kernel.module.unload()
    load_kernels(kernels, "cpu")
    values = wp.zeros(1, dtype=float, device="cpu")
    wp.launch(kernels[0], 1, inputs=[values], device="cpu")
    assert caplog.messages == []
    assert values.numpy().tolist() == [4.0]


def test_kernels_that_are_loaded_together_are_those_that_a_launch_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same bytes: a core of its own changes no bit of what a kernel computes."""
    wp.init()
    objects = []
    for folder, together in (("a", True), ("b", False)):
        monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / folder))
        kernels = kernels_of(3)
        for kernel in kernels:
            kernel.module.unload()
        if together:
            load_kernels(kernels, "cpu")
        for kernel in kernels:
            wp.launch(kernel, 1, inputs=[wp.zeros(1, dtype=float, device="cpu")], device="cpu")
        objects.append({p.name: p.read_bytes() for p in (tmp_path / folder).rglob("*.o")})
    assert len(objects[0]) == 2
    assert objects[0] == objects[1]


def test_who_asks_compiles_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With one thread nobody else does, with two one more: each reads Warp's header, for 1.3 s."""
    wp.init()
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))
    by: list[int] = []
    compiled = kernel_loading.seconds_to_load

    def noted(module: object, device: object) -> float:
        by.append(get_ident())
        return compiled(module, device)

    monkeypatch.setattr(kernel_loading, "seconds_to_load", noted)
    for number, threads in ((5, "1"), (6, "2")):
        monkeypatch.setenv("TENDON_NEWTON_THREADS", threads)
        load_kernels(kernels_of(number), "cpu")
    assert by[:2] == [get_ident()] * 2
    assert get_ident() in by[2:]
