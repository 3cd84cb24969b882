#!/bin/sh
# Install the Debian packages that some tests use, where that may be done; else say plainly what is missing.
set -u
missing=""
command -v bwrap >/dev/null 2>&1 || missing="$missing bubblewrap"
command -v chromium >/dev/null 2>&1 || missing="$missing chromium"
has_postgresql() { ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1; }
has_postgresql || missing="$missing postgresql"
[ -n "$missing" ] || exit 0

if command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
    echo "installing$missing"
    # shellcheck disable=SC2086
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing; } >/dev/null 2>&1
fi
for package in $missing; do
    case $package in bubblewrap) command=bwrap ;; postgresql) command=has_postgresql ;; *) command=$package ;; esac
    if [ $command = has_postgresql ]; then has_postgresql; else command -v $command >/dev/null 2>&1; fi || echo "NOT INSTALLED: $package. Tests that use it are skipped, with this reason. Install it by hand: apt-get install $package"
done
exit 0
