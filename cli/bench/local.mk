# softshadow bench. Its scenes are those of the tests.
softshadow_SOURCES += \
  %D%/backends.c %D%/backends.h \
  %D%/command.c %D%/bench.h %D%/clock.h \
  %D%/brute.c %D%/brute.h \
  %D%/figure10.c %D%/figure10.h tests/figure10.c tests/figure10.h \
  %D%/maps.c %D%/maps.h \
  %D%/measure.c %D%/truth.c \
  %D%/peer.c %D%/peer.h \
  %D%/rays.c \
  %D%/report.c %D%/report.h \
  %D%/scenes.c %D%/scenes.h \
  tests/scenes.c tests/scenes_bench.c tests/scenes.h
