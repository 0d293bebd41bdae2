/* load.c - finds and loads softshadow-image.so, once. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "image.h"

#define MODULE "softshadow-image.so"

enum { PATH = 4096 };

/* The folder the program lies in; libtool keeps a program that is not installed in .libs too. */
static bool beside_program(char path[PATH]) {
    char self[PATH];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0) return false;
    self[length] = '\0';
    char *slash = strrchr(self, '/');
    if (!slash) return false;
    *slash = '\0';
    const char *folder = strrchr(self, '/');
    const char *libs = folder && strcmp(folder, "/.libs") == 0 ? "" : "/.libs";
    const int n = snprintf(path, PATH, "%s%s/" MODULE, self, libs);
    return n > 0 && n < PATH && access(path, R_OK) == 0;
}

/* An installed program never looks beside itself: .libs is nothing but libtool's. */
static bool find_module(char path[PATH]) {
    const char *folder = getenv("SOFTSHADOW_MODULES");
    if (!folder || !*folder) {
        if (beside_program(path)) return true;
        folder = SOFTSHADOW_MODULE_DIR;
    }
    const int n = snprintf(path, PATH, "%s/" MODULE, folder);
    return n > 0 && n < PATH;
}

const image_module *image_load(cli_error *error) {
    static const image_module *loaded;
    if (loaded) return loaded;
    char path[PATH], shown[208];
    if (!find_module(path)) {
        cli_fail(error, CLI_FAILED, "SOFTSHADOW_MODULES: the path is too long");
        return NULL;
    }
    cli_show_path(path, shown);
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        cli_fail(error, CLI_FAILED, "%s: image files need this module, and it does not load: %s",
                 shown, dlerror());
        return NULL;
    }
    image_entry *entry;
    *(void **)&entry = dlsym(library, IMAGE_ENTRY); /* POSIX's own way from object to function */
    const image_module *module = entry ? entry() : NULL;
    if (!module || module->version != IMAGE_VERSION) {
        cli_fail(error, CLI_FAILED, "%s: is of another version than this program", shown);
        return NULL;
    }
    return loaded = module;
}
