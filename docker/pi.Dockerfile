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
# an emulator with Python 3.13, before the base had a digest. Not built on python:3.12-slim itself, nor by Docker, nor on a Pi.
# for every platform; another is `--build-arg BASE=...`
ARG BASE=python:3.12-slim@sha256:78387bc3881b8273120a12ebe6c1ab22b018ccc2c9adf565ae1ac9b536e184ea
FROM ${BASE}

# the group of serial ports in Debian
RUN useradd --create-home --groups dialout finger && install --directory --mode 1777 /data

WORKDIR /program
# what the program needs is a layer of its own: a changed source leaves it as it is
COPY pyproject.toml constraints.txt ./
RUN touch README.md LICENSE && pip install --no-cache-dir -c constraints.txt ".[hardware]"
COPY . .
RUN pip install --no-cache-dir --no-deps .

USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
