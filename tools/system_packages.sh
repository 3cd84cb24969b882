#!/bin/sh
# Install the Debian packages that some tests use, where that may be done; else say plainly what is missing.
# With --all, also those that the tests of contrib/serial use.
set -u
missing=""
command -v bwrap >/dev/null 2>&1 || missing="$missing bubblewrap"
command -v chromium >/dev/null 2>&1 || missing="$missing chromium"
command -v octave-cli >/dev/null 2>&1 || missing="$missing octave"
has_postgresql() { ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1; }
has_postgresql || missing="$missing postgresql"
has_avr_libc() { [ -e /usr/lib/avr/include/avr/io.h ]; }
has_simavr() { [ -e /usr/include/simavr/sim_avr.h ]; }
has_libelf() { [ -e /usr/include/libelf.h ]; }
if [ "${1:-}" = --all ]; then
    command -v avr-gcc >/dev/null 2>&1 || missing="$missing gcc-avr"
    has_avr_libc || missing="$missing avr-libc"
    has_simavr || missing="$missing libsimavr-dev"
    has_libelf || missing="$missing libelf-dev"
fi
[ -n "$missing" ] || exit 0

if command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
    echo "installing$missing"
    # shellcheck disable=SC2086
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing; } >/dev/null 2>&1
fi
for package in $missing; do
    case $package in
        bubblewrap) command=bwrap ;;
        gcc-avr) command=avr-gcc ;;
        octave) command=octave-cli ;;
        postgresql) command=has_postgresql ;;
        avr-libc) command=has_avr_libc ;;
        libsimavr-dev) command=has_simavr ;;
        libelf-dev) command=has_libelf ;;
        *) command=$package ;;
    esac
    case $command in has_*) $command ;; *) command -v $command >/dev/null 2>&1 ;; esac || echo "NOT INSTALLED: $package. Tests that use it are skipped, with this reason. Install it by hand: apt-get install $package"
done
exit 0
