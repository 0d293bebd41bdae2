# The contract: what a host may do to the library and what the library may do to a host.
scripts = %D%/symbols.sh %D%/header.sh %D%/host_state.sh %D%/diff.sh
dist_check_SCRIPTS += $(scripts)
TESTS += $(scripts)

hosts = %D%/dlopen %D%/fork %D%/missing %D%/foreign %D%/threadless %D%/guard \
  %D%/gpu_faults %D%/gpu_host %D%/gpu_glx
check_PROGRAMS += $(hosts) %D%/host_state
TESTS += $(hosts)
EXTRA_DIST += %D%/plain.h %D%/require.h %D%/compatible.py %D%/libsoftshadow.abi.xml
HOST_CPPFLAGS = -I$(top_srcdir)/lib -I$(top_srcdir)/tests

# Knows the library by its file name only.
%C%_dlopen_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_dlopen_LDADD = -ldl
%C%_fork_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_fork_LDADD = libsoftshadow.la
# Exported: what these hosts define stands before what libraries bring.
EXPORTING = $(AM_CFLAGS) -fvisibility=default
%C%_missing_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_missing_LDADD = libsoftshadow.la -ldl
%C%_missing_CFLAGS = $(EXPORTING)
%C%_missing_LDFLAGS = -export-dynamic
%C%_foreign_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_foreign_LDADD = libsoftshadow.la
%C%_foreign_CFLAGS = $(EXPORTING)
%C%_foreign_LDFLAGS = -export-dynamic
%C%_gpu_faults_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_gpu_faults_LDADD = libsoftshadow.la -ldl
%C%_gpu_faults_CFLAGS = $(EXPORTING)
%C%_gpu_faults_LDFLAGS = -export-dynamic
%C%_gpu_host_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_gpu_host_LDADD = libsoftshadow.la -ldl -lpthread
%C%_gpu_glx_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_gpu_glx_LDADD = libsoftshadow.la -ldl
%C%_guard_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_guard_LDADD = libsoftshadow.la
%C%_threadless_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_threadless_LDADD = libsoftshadow.la -ldl
%C%_threadless_CFLAGS = $(EXPORTING)
%C%_threadless_LDFLAGS = -export-dynamic
%C%_host_state_CPPFLAGS = $(HOST_CPPFLAGS)
%C%_host_state_LDADD = libsoftshadow.la -lm -lpthread

# A program of 1.0: its header stands before today's.
check_PROGRAMS += %D%/of_1_0
TESTS += %D%/of_1_0
%C%_of_1_0_SOURCES = %D%/of_1_0.c %D%/old/softshadow.h
%C%_of_1_0_CPPFLAGS = -I$(srcdir)/%D%/old -I$(srcdir)/tests
%C%_of_1_0_LDADD = libsoftshadow.la

if HAVE_CMOCKA
contracts = %D%/arguments %D%/handles %D%/memory
check_PROGRAMS += $(contracts)
TESTS += $(contracts)
%C%_arguments_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_arguments_LDADD = $(PROOF_LIBS)
%C%_handles_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_handles_LDADD = $(PROOF_LIBS)
%C%_memory_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_memory_LDADD = $(PROOF_LIBS) -ldl
%C%_memory_CFLAGS = $(EXPORTING) -fexceptions
%C%_memory_LDFLAGS = -export-dynamic
endif

# make check-bits: the library built by gcc and by clang, without and with all optimisation, on every
# instruction-set rung: one program must get the same bits from all of them. See bits.sh.
EXTRA_DIST += %D%/bits.sh
if HAVE_CMOCKA
EXTRA_PROGRAMS += %D%/digest
%C%_digest_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_digest_LDADD = $(PROOF_LIBS) -ldl
check-bits: %D%/digest
	@$(AM_TESTS_ENVIRONMENT) $(SHELL) $(srcdir)/%D%/bits.sh
endif
.PHONY: check-bits

# make check-valgrind: see valgrind.sh.
EXTRA_DIST += %D%/valgrind.sh %D%/valgrind.supp
check-valgrind: %D%/dlopen libsoftshadow.la
	@$(AM_TESTS_ENVIRONMENT) $(SHELL) $(srcdir)/%D%/valgrind.sh
.PHONY: check-valgrind

# make check-threads: the tests in which threads meet, under ThreadSanitizer, in a build of their own.
EXTRA_DIST += %D%/threads.sh %D%/threads.supp
check-threads:
	@$(SHELL) $(srcdir)/%D%/threads.sh
.PHONY: check-threads

# make renew-abi: see diff.sh.
renew-abi: libsoftshadow.la
	@$(AM_TESTS_ENVIRONMENT) $(SHELL) $(srcdir)/%D%/diff.sh renew
.PHONY: renew-abi
