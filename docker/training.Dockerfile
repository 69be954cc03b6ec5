# Diagnosing, simulating and training, on NVIDIA GPUs where `docker run --gpus all` gives them. Not built yet.
#
#   docker build -f docker/training.Dockerfile -t tendon-newton .
#   docker run --rm --gpus all -v "$PWD:/data" tendon-newton train-policy --out policy
#   docker run --rm -v "$PWD:/data" tendon-newton demo
#
# Warp brings its own compiler; a driver of the host is all that a GPU needs. PyPI's torch for Linux is a CUDA build; for one
# without CUDA add `--build-arg TORCH_INDEX=https://download.pytorch.org/whl/cpu`.
FROM python:3.12-slim

ARG TORCH_INDEX=https://pypi.org/simple
# libgl1 and libglib2.0-0 are what USD's and MuJoCo's wheels link to
RUN apt-get update && apt-get install --yes --no-install-recommends libgl1 libglib2.0-0 \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /program
COPY pyproject.toml README.md LICENSE constraints.txt ./
RUN pip install --no-cache-dir --index-url "$TORCH_INDEX" "torch==$(sed -n 's/^torch==//p' constraints.txt)"
COPY tendon_newton tendon_newton
COPY train train
COPY hardware hardware
COPY assets assets
COPY examples/hidden_friction examples/hidden_friction
RUN pip install --no-cache-dir -c constraints.txt ".[sim,train,hardware]"

# kernels that Warp has compiled outlive a container if /cache is a volume
ENV WARP_CACHE_PATH=/cache/warp
RUN useradd --create-home finger && mkdir -p /cache && chown finger /cache
USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
