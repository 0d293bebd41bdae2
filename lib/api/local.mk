# The public functions: validate once, delegate.
libsoftshadow_core_la_SOURCES += %D%/api.c %D%/structs.c %D%/structs.h
