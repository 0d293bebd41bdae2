# Points as streams: sources that read them, sinks that write what was answered.
libcli_la_SOURCES += \
  %D%/points.h \
  %D%/source.c %D%/text.c %D%/binary.c %D%/ply.c %D%/image.c \
  %D%/sink.c %D%/sink_ply.c
