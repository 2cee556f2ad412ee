#!/bin/sh
# Installs the Debian 12 packages the project needs: the core to build and test it, groups on request.
#   cmake/install-deps.sh [--gis] [--peers] [--fuzz] [--planning] [--viewer] [--laz] [--load] [--ros1] [--python] [--mpi]
# Does nothing when everything is there. Uses sudo only when not root.
set -eu

core="build-essential cmake ninja-build pkg-config libeigen3-dev libtbb-dev libnanoflann-dev libhdf5-dev \
libbenchmark-dev libgtest-dev libgmock-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libyaml-cpp-dev libpng-dev libtiff-dev \
libboost-dev libxxhash-dev libisal-dev libproj-dev libseccomp-dev zlib1g-dev curl file"
gis="gdal-bin python3-gdal netcdf-bin python3-h5py python3-xarray python3-netcdf4"
peers="libpcl-dev pcl-tools"  # large; for -DBTMS_WITH_PCL=ON, and a test of exports
planning="libompl-dev"  # apps/examples/ompl_plan.cpp
python="python3-dev pybind11-dev python3-numpy python3-pytest python3-xarray python3-matplotlib"
ros1="libroscpp-dev libsensor-msgs-dev python3-rosbag python3-rospy python3-sensor-msgs python3-rosmaster python3-numpy"  # apps/ros1 and its test
mpi="libopenmpi-dev openmpi-bin"  # -DBTMS_WITH_MPI=ON
load="wrk"  # tests/load.sh
laz="nodejs npm"  # apps/laz: reads LAZ and COPC
viewer="nodejs npm chromium"  # apps/viewer and its tests
fuzz="clang-16 libclang-rt-16-dev"  # tests/fuzz/run.sh

wanted=$core
for argument in "$@"; do
  case $argument in
    --gis) wanted="$wanted $gis" ;;
    --peers) wanted="$wanted $peers" ;;
    --fuzz) wanted="$wanted $fuzz" ;;
    --planning) wanted="$wanted $planning" ;;
    --python) wanted="$wanted $python" ;;
    --ros1) wanted="$wanted $ros1" ;;
    --mpi) wanted="$wanted $mpi" ;;
    --laz) wanted="$wanted $laz" ;;
    --load) wanted="$wanted $load" ;;
    --viewer) wanted="$wanted $viewer" ;;
    -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
    *) echo "install-deps.sh: unknown group $argument; there are --gis, --ros1, --peers, --fuzz, --planning, --viewer, --laz, --load, --python and --mpi" >&2; exit 2 ;;
  esac
done

missing=
for package in $wanted; do
  status=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
  [ "$status" = "install ok installed" ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

as_root=
if [ "$(id -u)" != 0 ]; then as_root=sudo; fi
echo "install-deps.sh: installing$missing" >&2
export DEBIAN_FRONTEND=noninteractive
$as_root apt-get update -qq
# shellcheck disable=SC2086  # a list of packages
$as_root apt-get install -y -qq --no-install-recommends $missing >/dev/null
