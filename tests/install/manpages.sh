#!/bin/sh
# The man pages are sound, and they name every function of the library and every command.
set -u
bad=0
wrong() { echo "wrong: $*"; bad=1; }
command -v groff >/dev/null || { echo "groff is not there (Debian package groff-base)"; exit 77; }
one=$top_srcdir/cli/softshadow.1 three=$top_srcdir/lib/softshadow.3
for page in "$one" "$three"; do
    said=$(groff -mdoc -Tutf8 -ww -z "$page" 2>&1)
    [ -z "$said" ] || wrong "$page: $said"
done
functions=$(sed -n 's/^ *\(softshadow_[a-z_]*\);$/\1/p' "$top_srcdir/lib/softshadow.map")
[ -n "$functions" ] || wrong "softshadow.map names no function"
for function in $functions; do
    grep -q "^\.Fn $function " "$three" || wrong "softshadow.3 lacks $function"
done
commands=$("$top_builddir/softshadow" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p')
[ -n "$commands" ] || wrong "softshadow --help names no command"
for command in $commands; do
    grep -q "^\.Cm $command$" "$one" || wrong "softshadow.1 lacks the command $command"
done
exit "$bad"
