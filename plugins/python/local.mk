# The Python package softshadow, in pkgpythondir = $(pythondir)/softshadow. The test compares this list
# with the folder.
python_package = \
  %D%/softshadow/__init__.py \
  %D%/softshadow/_abi.py \
  %D%/softshadow/_buffers.py \
  %D%/softshadow/_errors.py \
  %D%/softshadow/_host.py \
  %D%/softshadow/_lights.py \
  %D%/softshadow/_load.py \
  %D%/softshadow/_results.py \
  %D%/softshadow/_scene.py
EXTRA_DIST += %D%/README.md %D%/ground.py %D%/ground.png $(python_package) %D%/softshadow/py.typed

if HAVE_PYTHON
pkgpython_PYTHON = $(python_package)
pkgpython_DATA = %D%/softshadow/py.typed

# Where the library went is known when it is installed, not before: make install libdir=... is allowed.
install-data-hook: install-python-place
install-python-place:
	printf '# Written by make install.\nLIBDIR = "%s"\n' '$(libdir)' >'$(DESTDIR)$(pkgpythondir)/_installed.py'
uninstall-hook: uninstall-python-place
uninstall-python-place:
	-rm -f '$(DESTDIR)$(pkgpythondir)/_installed.py'
	-rm -rf '$(DESTDIR)$(pkgpythondir)/__pycache__'
	-rmdir '$(DESTDIR)$(pkgpythondir)'
endif
.PHONY: install-python-place uninstall-python-place
