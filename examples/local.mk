# Examples are built against the installed package, by examples/Makefile (tests/install does).
EXTRA_DIST += \
  %D%/Makefile \
  %D%/01_one_triangle.c %D%/02_error_bound.c %D%/03_lights.c %D%/04_in_a_host.c %D%/05_dlopen.c %D%/06_tinytracer.c \
  %D%/composite.sh %D%/demo.sh %D%/fetch-models \
  %D%/pictures/bunny.png %D%/pictures/light.png %D%/pictures/maps.svg %D%/pictures/tinytracer.png

# Out of tree, too: everything lands in $(builddir)/demo.
demo: all
	@top_srcdir='$(abs_top_srcdir)' top_builddir='$(abs_top_builddir)' sh $(srcdir)/%D%/demo.sh
.PHONY: demo
clean-local-demo:
	-rm -rf demo
clean-local: clean-local-demo
