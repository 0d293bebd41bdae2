libsoftshadow_core_la_SOURCES +=
