# Diagnosing, simulating and training, on NVIDIA GPUs where `docker run --gpus all` gives them.
ARG PYTHON_VERSION=3.12
FROM python:${PYTHON_VERSION}-slim

WORKDIR /program
# what the program needs is a layer of its own: a changed source leaves it as it is
COPY pyproject.toml constraints.txt ./
ARG TORCH_INDEX=https://pypi.org/simple
RUN pip install --no-cache-dir --no-deps --index-url "$TORCH_INDEX" "$(grep '^torch==' constraints.txt)"
RUN touch README.md LICENSE && pip install --no-cache-dir -c constraints.txt ".[sim,train,hardware]"
COPY . .
RUN pip install --no-cache-dir --no-deps .

# kernels that Warp has compiled outlive a container if /cache is a volume
ENV WARP_CACHE_PATH=/cache/warp
RUN useradd --create-home finger && install --directory --owner finger /cache /data
USER finger
WORKDIR /data
ENTRYPOINT ["tendon-newton"]
CMD ["--help"]
