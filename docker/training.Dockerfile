# Diagnosing, simulating and training, on NVIDIA GPUs where `docker run --gpus all` gives them.
#
#   docker build -f docker/training.Dockerfile -t tendon-newton .
#   docker run --rm --init --gpus all -v "$PWD:/data" -v tendon-newton-cache:/cache tendon-newton train-policy --out policy
#   docker run --rm -v "$PWD:/data" tendon-newton demo
#
# Warp brings its own compiler; a driver of the host is all that a GPU needs. PyPI's torch for Linux is a CUDA build; for one
# without CUDA add `--build-arg TORCH_INDEX=https://download.pytorch.org/whl/cpu`. With `--init` a training ends at `docker stop`.
# The program runs as user 1000; another adds `--user "$(id -u)"`.
#
# Built and run on x86-64 with buildah and podman, without a GPU, on a stand-in for the base image: Debian trixie with Python 3.11
# and torch without CUDA, before the base had a digest and packages their hashes. Not built on python:3.12-slim itself, nor by Docker.
# for every platform; another is `--build-arg BASE=...`
ARG BASE=python:3.12-slim@sha256:78387bc3881b8273120a12ebe6c1ab22b018ccc2c9adf565ae1ac9b536e184ea
FROM ${BASE} AS wheel
WORKDIR /program
COPY .github/requirements-build.txt ./
RUN pip install --no-cache-dir --no-deps --require-hashes -r requirements-build.txt
COPY . .
RUN python -m build --wheel --no-isolation --outdir /wheel

FROM ${BASE}

RUN useradd --create-home finger && install --directory --mode 1777 /cache /data
# kernels that Warp has compiled outlive a container if /cache is a volume
ENV WARP_CACHE_PATH=/cache/warp

WORKDIR /program
# what the program needs are layers of their own: a changed source leaves them as they are
COPY constraints.txt requirements-hashes.txt requirements-hashes-sim.txt ./
RUN pip install --no-cache-dir --no-deps --require-hashes -r requirements-hashes-sim.txt
ARG NEEDED="cloudpickle|dynamixel-sdk|filelock|flatbuffers|gitdb|gitpython|grpcio|markdown|ml-dtypes|mpmath|networkx|onnx|onnx-ir|onnxruntime|\
onnxscript|protobuf|pyserial|pyvers|rsl-rl-lib|safetensors|setuptools|smmap|sympy|tensorboard|tensorboard-data-server|tensordict|werkzeug"
RUN awk -v needed="^($NEEDED)==" '/^[a-z]/ {keep = $0 ~ needed} keep' requirements-hashes.txt > needed.txt \
    && pip install --no-cache-dir --no-deps --require-hashes -r needed.txt
# torch alone has no hash here, nor has what its CUDA build brings
ARG TORCH_INDEX=https://pypi.org/simple
RUN pip install --no-cache-dir --no-deps --index-url "$TORCH_INDEX" "$(grep '^torch==' constraints.txt)"
RUN pip install --no-cache-dir -c constraints.txt "$(grep '^torch==' constraints.txt)"
# without an index: what the lists above lack is refused
COPY --from=wheel /wheel /wheel
RUN pip install --no-cache-dir --no-index "$(ls /wheel/*.whl)[sim,train,hardware]"

USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
