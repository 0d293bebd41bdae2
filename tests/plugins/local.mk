include %D%/python/local.mk
include %D%/oiio/local.mk
include %D%/blender/local.mk
include %D%/freecad/local.mk
include %D%/povray/local.mk
