# What drives a bench, without the simulator: a Raspberry Pi 4 or 5 with a 64-bit system, or any computer.
#
#   docker build -f docker/pi.Dockerfile -t tendon-newton-pi .
#   docker run --rm -v "$PWD:/data" tendon-newton-pi collect --port virtual --faster-than-real-time --out recordings
#   docker run --rm -it -v "$PWD:/data" --device /dev/ttyUSB0 --device /dev/ttyACM0 --pid host -v /run/lock:/run/lock \
#       tendon-newton-pi doctor --port /dev/ttyUSB0 --load-cell-port /dev/ttyACM0
#
# At a real port `--pid host` lets the watchdog of a Feetech servo outlive a killed program, and `/run/lock` keeps programs of other
# containers, and of none, off the port. The program runs as user 1000; another adds `--user "$(id -u)" --group-add dialout`.
#
# Built and run with buildah and podman on a stand-in for the base image, Debian trixie: on x86-64 with Python 3.12, and for ARM in
# an emulator with Python 3.13, before the base had a digest and packages their hashes. Not built on python:3.12-slim itself, nor by Docker, nor on a Pi.
# for every platform; another is `--build-arg BASE=...`
ARG BASE=python:3.12-slim@sha256:78387bc3881b8273120a12ebe6c1ab22b018ccc2c9adf565ae1ac9b536e184ea
FROM ${BASE} AS wheel
WORKDIR /program
COPY .github/requirements-build.txt ./
RUN pip install --no-cache-dir --no-deps --require-hashes -r requirements-build.txt
COPY . .
RUN python -m build --wheel --no-isolation --outdir /wheel

FROM ${BASE}

# the group of serial ports in Debian
RUN useradd --create-home --groups dialout finger && install --directory --mode 1777 /data

WORKDIR /program
# what the program needs is a layer of its own: a changed source leaves it as it is
COPY requirements-hashes.txt requirements-hashes-sim.txt ./
ARG NEEDED="docstring-parser|dynamixel-sdk|flatbuffers|lz4|mcap|mcap-ros2-support|numpy|onnxruntime|packaging|protobuf|pyserial|tomli-w|typeguard|\
typing-extensions|tyro|zstandard"
RUN awk -v needed="^($NEEDED)==" '/^[a-z]/ {keep = $0 ~ needed} keep' requirements-hashes.txt requirements-hashes-sim.txt > needed.txt \
    && pip install --no-cache-dir --no-deps --require-hashes -r needed.txt
# without an index: what the list above lacks is refused
COPY --from=wheel /wheel /wheel
RUN pip install --no-cache-dir --no-index "$(ls /wheel/*.whl)[hardware]"

USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
