# softshadow bench. Its scenes are those of the tests.
softshadow_SOURCES += \
  %D%/backends.c %D%/backends.h \
  %D%/command.c %D%/bench.h %D%/clock.h \
  %D%/brute.c %D%/brute.h \
  %D%/figure10.c %D%/figure10.h tests/figure10.c tests/figure10.h \
  %D%/front.c \
  %D%/maps.c %D%/maps.h \
  %D%/matrix.c %D%/matrix.h \
  %D%/map_times.c %D%/map_times.h \
  %D%/measure.c %D%/truth.c \
  %D%/peer.c %D%/peer.h \
  %D%/pictures.c \
  %D%/rays.c \
  %D%/report.c %D%/report.h \
  %D%/rows.c \
  %D%/scenes.c %D%/scenes.h \
  %D%/stretches.c %D%/stretches.h \
  %D%/sweep.c \
  tests/scenes.c tests/scenes_bench.c tests/scenes.h
