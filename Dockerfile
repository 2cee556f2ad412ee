# The program in Debian 12, as its own Debian package: docker build -t btms .
#   docker run --rm -v "$PWD:/data" btms build tile.las -o town.btms
#   docker run --rm -v "$PWD:/data" -p 8080:8080 btms serve town.btms --address 0.0.0.0 --public
FROM debian:12 AS build
WORKDIR /source
COPY cmake/install-deps.sh cmake/
RUN cmake/install-deps.sh --viewer --laz
COPY . .
RUN cmake --preset release \
 && cmake --build --preset release --target installed \
 && cpack --config build/release/CPackConfig.cmake -B /package

FROM debian:12-slim
COPY --from=build /package/*.deb /tmp/
RUN apt-get update \
 && apt-get install -y --no-install-recommends /tmp/btms_*.deb nodejs \
 && rm -rf /tmp/*.deb /var/lib/apt/lists/* \
 && useradd --create-home btms
USER btms
WORKDIR /data
EXPOSE 8080
ENTRYPOINT ["btms"]
CMD ["--help"]
