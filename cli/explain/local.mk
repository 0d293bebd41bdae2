# explain: one point's view of a light.
libcli_la_SOURCES += %D%/hiders.c %D%/hiders.h
softshadow_SOURCES += %D%/explain.c
