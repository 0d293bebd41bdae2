# softshadow query
softshadow_SOURCES += \
  %D%/command.c %D%/run.c %D%/query.h \
  %D%/target.c \
  %D%/journal.c %D%/journal.h \
  %D%/sample.c %D%/sample.h
