#!/bin/sh
# The man pages are sound and name every function of the library and every command; the README's
# program is the first example, and what it shows of the command line is what comes out.
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
    # The bench's many numbers are in its --help.
    [ "$command" != bench ] || continue
    options=$("$top_builddir/softshadow" "$command" --help | sed -n 's/^  .\{4\}--\([a-z0-9-]*\).*/\1/p')
    [ -n "$options" ] || wrong "softshadow $command --help names no option"
    for option in $options; do
        [ "$option" = output ] || grep -qE "Fl -$option( |$)" "$one" ||
            wrong "softshadow.1 lacks $command's --$option"
    done
done

# README.md: its first block of C, and its first command with what it prints.
readme=$top_srcdir/README.md
sed -n '/^```c$/,/^```$/p' "$readme" | sed '1d; /^```$/,$d' | cmp -s - "$top_srcdir/examples/01_one_triangle.c" ||
    wrong "the README's C program is not examples/01_one_triangle.c"
bunny=/usr/share/glmark2/models/bunny.obj
if [ -r $bunny ]; then
    sed -n '/^\$ printf/,/^```$/p' "$readme" | sed '$d' >shown.$$
    sed -n '1,2p' shown.$$ | sed 's/^\$ //' >command.$$
    sed '1,2d' shown.$$ >wanted.$$
    PATH=$top_builddir:$PATH sh ./command.$$ >got.$$ || wrong "the README's command fails"
    # Whoever compares must see the same number. exact has no noise and gives the same bits on every
    # processor; one sample more or less would be over 1e-4, so that 1e-5 is for the last digit.
    paste wanted.$$ got.$$ | awk '{ e = $4 - $8; n += NF == 8 && e <= 1e-5 && e >= -1e-5 }
        END { exit !(n == 3) }' || wrong "the README shows $(cat wanted.$$), its command gives $(cat got.$$)"
    rm -f shown.$$ command.$$ wanted.$$ got.$$
fi
exit "$bad"
