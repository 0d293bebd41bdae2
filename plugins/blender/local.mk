# The Blender add-on: one archive, which Blender's own "Install..." takes. The Python package goes in with it.
blender_addon = \
  %D%/softshadow_blender/__init__.py \
  %D%/softshadow_blender/ask.py \
  %D%/softshadow_blender/cover.py \
  %D%/softshadow_blender/gather.py \
  %D%/softshadow_blender/library.py \
  %D%/softshadow_blender/lights.py \
  %D%/softshadow_blender/operators.py \
  %D%/softshadow_blender/panel.py \
  %D%/softshadow_blender/places.py \
  %D%/softshadow_blender/preview.py \
  %D%/softshadow_blender/results.py \
  %D%/softshadow_blender/settings.py
EXTRA_DIST += %D%/README.md %D%/picture.py %D%/preview.png %D%/pack.py $(blender_addon)

if HAVE_PYTHON
# Where the library went is known when it is installed, not before: make install libdir=... is allowed.
install-data-hook: install-blender
install-blender:
	$(MKDIR_P) '$(DESTDIR)$(pkgdatadir)'
	$(PYTHON) $(srcdir)/%D%/pack.py '$(DESTDIR)$(pkgdatadir)/softshadow-blender.zip' '$(libdir)' \
	  $(srcdir) $(blender_addon) $(python_package) LICENSE
uninstall-hook: uninstall-blender
uninstall-blender:
	-rm -f '$(DESTDIR)$(pkgdatadir)/softshadow-blender.zip'
	-rmdir '$(DESTDIR)$(pkgdatadir)' 2>/dev/null
endif
.PHONY: install-blender uninstall-blender
