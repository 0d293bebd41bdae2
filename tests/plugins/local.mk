include %D%/python/local.mk
