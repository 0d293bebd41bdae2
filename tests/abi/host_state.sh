#!/bin/sh
# Runs host_state with a comma locale made on the spot, as most machines have none installed.
set -u
here=${top_builddir:-.}/tests/abi
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT
if localedef --no-archive -c -i de_DE -f UTF-8 "$work/de_DE.UTF-8" >"$work/log" 2>&1 || [ -d "$work/de_DE.UTF-8" ]; then
    LOCPATH=$work; export LOCPATH
else
    echo "SKIPPED the comma locale: localedef cannot make one (Debian package locales): $(tail -n 1 "$work/log")"
fi
"$here/host_state"
