# tunneldb as a container, for workers: docker compose up -d --scale worker=4
FROM python:3.11-slim

# Rasterio's wheel has GDAL in it, but not Expat.
RUN apt-get update \
 && apt-get install -y --no-install-recommends libexpat1 \
 && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml README.md LICENSE /src/
COPY tunneldb /src/tunneldb
COPY sql /src/sql
COPY migrations /src/migrations
RUN pip install --no-cache-dir "/src[e57]" && rm -rf /src

# A home of its own: Numba keeps what it has compiled there.
RUN useradd --create-home tunneldb
USER tunneldb
WORKDIR /home/tunneldb

ENTRYPOINT ["tunneldb"]
CMD ["--help"]
