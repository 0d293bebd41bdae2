# POV-Ray has no plugins: macros for scenes, and softshadow povray beside them.
EXTRA_DIST += %D%/README.md %D%/picture.sh %D%/bunny.png
povraydir = $(pkgdatadir)/povray
dist_povray_DATA = %D%/softshadow.inc
