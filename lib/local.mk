# The library: its rooms make one archive (unit tests link that, to reach what is hidden); the shared
# object adds the symbol map.
noinst_LTLIBRARIES += libsoftshadow-core.la
libsoftshadow_core_la_SOURCES = %D%/softshadow.h
libsoftshadow_core_la_LIBADD =

include %D%/base/local.mk
include %D%/scene/local.mk
include %D%/topology/local.mk
include %D%/silhouette/local.mk
include %D%/map/local.mk
include %D%/raster/local.mk
include %D%/trace/local.mk
include %D%/coverage/local.mk
include %D%/technique/local.mk
include %D%/engine/local.mk
include %D%/api/local.mk

libsoftshadow_core_la_LIBADD += $(OPENMESH_LIBS) -lm -lpthread -ldl

lib_LTLIBRARIES += libsoftshadow.la
include_HEADERS = %D%/softshadow.h
dist_man_MANS += %D%/softshadow.3
pkgconfig_DATA = %D%/softshadow.pc
EXTRA_DIST += %D%/softshadow.map %D%/README.md %D%/LAYERS
libsoftshadow_la_SOURCES =
# Never compiled: makes automake link with the C++ compiler, which the OpenMesh shims need.
nodist_EXTRA_libsoftshadow_la_SOURCES = %D%/linked-as-c++.cc
libsoftshadow_la_LIBADD = libsoftshadow-core.la
# nodelete: a host that dlcloses us would crash in threads that TBB, below Embree, leaves behind.
# The version script is also what keeps weak std:: symbols of the shims inside.
libsoftshadow_la_LDFLAGS = -version-info $(SOFTSHADOW_LT_VERSION) -no-undefined \
  -Wl,--version-script=$(srcdir)/%D%/softshadow.map -Wl,-z,nodelete -Wl,--as-needed
EXTRA_libsoftshadow_la_DEPENDENCIES = %D%/softshadow.map
