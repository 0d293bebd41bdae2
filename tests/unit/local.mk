# Unit tests: each links the library's archive, so that it can reach what is hidden.
dist_check_SCRIPTS += %D%/layers.sh
TESTS += %D%/layers.sh
