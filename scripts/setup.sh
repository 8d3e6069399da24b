# Sourced by ./demo and ./check: packages, configuring, building. Sets `root`, the folder of the project.
# shellcheck shell=bash
# shellcheck disable=SC2034  # the lists are used by the sourcing scripts

root=$(cd -P "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

# Package names of Debian 12 and newer. 'package:command': the command on the PATH suffices as well.
build_packages=(
  g++:c++ cmake:cmake ninja-build:ninja pkg-config:pkg-config
  python3-glad:glad                # writes the OpenGL loader while building
  libglfw3-dev libimgui-dev libgl-dev libcli11-dev libtomlplusplus-dev libfmt-dev nlohmann-json3-dev libpng-dev
  zlib1g-dev
  libhdf5-dev                      # dumps of trajectories
  libegl1 libgl1-mesa-dri          # drawing without a display, and without a GPU
  fonts-dejavu-core ffmpeg:ffmpeg  # text in window and film; films
)
plot_packages=(
  python3:python3
  python3-matplotlib               # the lab's charts
)
test_packages=(
  libgtest-dev python3:python3
  libopenmpi-dev openmpi-bin:mpirun  # domains in several processes
  libboost-context-dev             # fibers: the GPU's kernels on a CPU
  xvfb:Xvfb xdotool:xdotool        # a virtual screen, and input to its windows
  x11-xkb-utils:setxkbmap          # keyboards of other countries there
  codespell:codespell              # misspelt words
)
reader_packages=(                  # readers of dumps; tests are skipped without them
  hdf5-tools:h5ls python3-h5py python3-mdanalysis
  python3-pip                      # for pyh5md, and VTK's reader of XDMF, which are on PyPI only
)
all_packages=(                     # of ./check --all
  clang:clang++ clang-tidy:clang-tidy
  libclang-rt-dev                  # Clang's sanitizers
  dpkg-dev file:file help2man:help2man desktop-file-utils:desktop-file-validate  # packages
)

say() { printf '%s\n' "$*" >&2; }

stop() {
  say "$@"
  exit 1
}

# Prints the names of missing packages among the given entries, one per line.
missing_packages() {
  local installed entry
  installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${@%%:*}" 2>/dev/null)
  for entry in "$@"; do
    [[ $'\n'$installed$'\n' == *$'\n'"installed ${entry%%:*}"$'\n'* ]] && continue
    [[ $entry == *:* ]] && command -v "${entry#*:}" >/dev/null && continue
    echo "${entry%%:*}"
  done
}

# install_packages ENTRY...: installs those that are missing.
install_packages() {
  local missing log as_root=()
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]})) || return 0
  local command="apt-get install --no-install-recommends ${missing[*]}"
  if ((EUID != 0)); then
    command -v sudo >/dev/null || stop "Packages are missing, and there is no sudo to install them with. As root:
  apt-get update && $command"
    as_root=(sudo)
  fi
  say "Installing packages${as_root:+ with sudo}: ${missing[*]}"
  log=$(mktemp)
  as_root+=(env DEBIAN_FRONTEND=noninteractive)
  local apt=("${as_root[@]}" apt-get -q -y -o DPkg::Lock::Timeout=300)
  # A failed update may concern a package source that is not needed.
  if ! { "${apt[@]}" update; "${apt[@]}" install --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
    tail -n 15 "$log" >&2
    stop "The packages could not be installed (all of apt's output: $log). They are those of Debian 12 and
newer; older releases lack some. By hand: $command"
  fi
  rm -f "$log"
}

# ensure_packages PRESET ENTRY...: installs missing packages. Without apt, a configured tree counts as complete.
ensure_packages() {
  local preset=$1
  shift
  if command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; then
    install_packages "$@"
  elif [[ ! -f $root/build/$preset/build.ninja ]]; then
    stop "This system is neither Debian nor Ubuntu. Install the contents of these Debian packages:
  ${*%%:*}
then configure once, in $root, and run this script again:
  cmake --preset $preset"
  fi
}

# cuda_state: what decides how kernels are built: nvcc, its version, the compiler beside it, and the GPUs.
cuda_state() {
  local nvcc
  nvcc=$(command -v nvcc || echo /usr/local/cuda/bin/nvcc)
  echo "$nvcc" "$("$nvcc" --version 2>/dev/null | tail -n 1)" "${CUDACXX-}" "${CUDAHOSTCXX-}" \
    "$(cat /proc/driver/nvidia/gpus/*/information 2>/dev/null | grep '^Model' | sort -u)"
}

# use_ccache: where it is installed, builds use it, with hits across trees in different folders.
launchers=()
use_ccache() {
  command -v ccache >/dev/null || return 0
  launchers=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_CUDA_COMPILER_LAUNCHER=ccache)
  export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1
}

# has_cmake: CMake 3.25 or newer.
has_cmake() {
  local version
  version=$(cmake --version | sed -n '1s/[^0-9]*//p')
  [[ $(printf '%s\n' 3.25 "$version" | sort -V | head -n 1) == 3.25 ]] ||
    stop "CMake 3.25 or newer is needed; the one on the PATH is $version"
}

# configure PRESET: only for a new or moved tree, or if nvcc, the GPUs or ccache have changed.
configure() {
  local preset=$1 folder=$root/build/$1 cuda home
  use_ccache
  cuda=$(cuda_state)
  local fresh=()
  if [[ -f $folder/CMakeCache.txt ]]; then
    home=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$folder/CMakeCache.txt")
    if [[ ! $home -ef $root ]] || [[ -f $folder/cuda_state && $(<"$folder/cuda_state") != "$cuda" ]] ||
      { ((!${#launchers[@]})) && grep -q '_COMPILER_LAUNCHER:.*=ccache' "$folder/CMakeCache.txt"; }; then
      fresh=(--fresh)
    elif [[ -f $folder/build.ninja ]]; then
      return 0
    fi
  fi
  has_cmake
  say "Configuring build/$preset"
  (cd "$root" && cmake --preset "$preset" "${fresh[@]}" "${launchers[@]}" >&2) || stop "Configuring failed; see above."
  echo "$cuda" >"$folder/cuda_state"
}

# with_tests PRESET: adds the tests to a build folder that lacks them, and keeps its build outputs.
with_tests() {
  grep -qx 'BUILD_TESTING:BOOL=ON' "$root/build/$1/CMakeCache.txt" ||
    cmake -DBUILD_TESTING=ON "$root/build/$1" >&2 || stop "Configuring the tests failed; see above."
}

# build PRESET [TARGET...]: prints nothing if all is up to date. CMAKE_BUILD_PARALLEL_LEVEL limits the number of jobs.
build() {
  local folder=$root/build/$1
  shift
  [[ $(ninja -C "$folder" -n "$@" 2>&1 | tail -n 1) == "ninja: no work to do." ]] && return
  say "Building build/${folder##*/}"
  cmake --build "$folder" ${1:+--target "$@"} >&2 || stop "The build failed; see above."
}
