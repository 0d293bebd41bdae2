# What is installed: used from outside, as a package; and what is written about it.
dist_check_SCRIPTS += %D%/examples.sh %D%/documents.sh
TESTS += %D%/examples.sh %D%/documents.sh
