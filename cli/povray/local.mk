# softshadow povray
softshadow_SOURCES += \
  %D%/command.c %D%/povray.h \
  %D%/scene.c %D%/surface.c %D%/bake.c \
  %D%/passes.c
softshadow_CPPFLAGS = $(AM_CPPFLAGS) -DSOFTSHADOW_POVRAY_DIR='"$(pkgdatadir)/povray"'
