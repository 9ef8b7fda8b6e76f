# shellcheck shell=bash
# The Debian packages that spindle needs, and how they are installed. Sourced by ./try and ./check.

# Used by the scripts that source this file.
# shellcheck disable=SC2034
build_packages=(
  g++ cmake ninja-build pkg-config ccache
  libmodbus-dev libcli11-dev libfmt-dev libyaml-dev libexpected-dev
  libsqlite3-dev libmosquitto-dev libpq-dev libcpp-httplib-dev
)
# shellcheck disable=SC2034
test_packages=(
  doctest-dev nlohmann-json3-dev mold
  clang-format-14 clang-14 clang-tidy-14 libclang-rt-14-dev
  python3-pymodbus python3-serial-asyncio mbpoll tshark socat
  python3-jsonschema mandoc dpkg-dev lintian sqlite3 systemd
  python3-scipy python3-statsmodels chromium
  mosquitto mosquitto-clients python3-paho-mqtt postgresql python3-psycopg2 curl tmux openssh-client
)

# Prints those of the named packages that are not installed, one a line.
missing_packages() {
  local package
  for package in "$@"; do
    if [[ $(dpkg-query -W -f='${Status}' "$package" 2>/dev/null) != "install ok installed" ]]; then
      printf '%s\n' "$package"
    fi
  done
}

# Runs a command as root; fails when that is not possible.
as_root() {
  if [[ $(id -u) -eq 0 ]]; then
    "$@"
  elif command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [[ -t 0 ]]; }; then
    sudo "$@"
  else
    return 1
  fi
}

# Installs what is missing of the named packages; touches no network when nothing is.
install_packages() {
  if ! command -v dpkg-query >/dev/null; then
    printf 'this is not a Debian system; going on, but these packages or their like are needed:\n' >&2
    printf '  %s\n' "$*" >&2
    return 0
  fi

  local missing
  mapfile -t missing < <(missing_packages "$@")
  if ((${#missing[@]} == 0)); then
    return 0
  fi

  printf 'installing: %s\n' "${missing[*]}"
  if command -v apt-get >/dev/null && as_root apt-get update -q &&
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
      "${missing[@]}"; then
    return 0
  fi
  printf 'could not install these Debian packages: %s\n' "${missing[*]}" >&2
  printf 'install them by hand, as root: apt-get install %s\n' "${missing[*]}" >&2
  return 1
}
