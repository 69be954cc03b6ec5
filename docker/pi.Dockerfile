# What drives a bench, without the simulator: a Raspberry Pi 4 or 5 with a 64-bit system, or any computer. Not built yet.
#
#   docker build -f docker/pi.Dockerfile -t tendon-newton-pi .
#   docker run --rm -it -v "$PWD:/data" tendon-newton-pi collect --port virtual --faster-than-real-time --out recordings
#   docker run --rm -it -v "$PWD:/data" --device /dev/ttyUSB0 --device /dev/ttyACM0 tendon-newton-pi doctor --port /dev/ttyUSB0
#
# The loop keeps its rate only where the container may: --cap-add SYS_NICE, and nothing else on the computer.
FROM python:3.12-slim

WORKDIR /program
COPY pyproject.toml README.md LICENSE constraints.txt ./
COPY tendon_newton tendon_newton
COPY train train
COPY hardware hardware
COPY assets assets
COPY examples/hidden_friction examples/hidden_friction
RUN pip install --no-cache-dir --no-compile -c constraints.txt ".[hardware]"

# the group of serial ports in Debian
RUN useradd --create-home --groups dialout finger
USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
