# What drives a bench, without the simulator: a Raspberry Pi 4 or 5 with a 64-bit system, or any computer.
ARG PYTHON_VERSION=3.12
FROM python:${PYTHON_VERSION}-slim

WORKDIR /program
# what the program needs is a layer of its own: a changed source leaves it as it is
COPY pyproject.toml constraints.txt ./
RUN touch README.md LICENSE && pip install --no-cache-dir -c constraints.txt ".[hardware]"
COPY . .
RUN pip install --no-cache-dir --no-deps .

# the group of serial ports in Debian
RUN useradd --create-home --groups dialout finger && install --directory --owner finger /data
USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
