include %D%/python/local.mk
include %D%/oiio/local.mk
