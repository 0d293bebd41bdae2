# Each adapts one host to the public header; none reaches into the library. The reader of OpenImageIO is
# `softshadow render` and links libcli.la, too.
EXTRA_DIST += %D%/README.md
include %D%/python/local.mk
include %D%/oiio/local.mk
include %D%/blender/local.mk
include %D%/povray/local.mk
