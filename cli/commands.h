/* The commands: argv[0] is the command's name; each returns the exit status: 0 done, 1 the work
 * failed, 2 it was asked wrongly. */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

int cli_query(int argc, char **argv);
int cli_methods(int argc, char **argv);
int cli_info(int argc, char **argv);
int cli_bench(int argc, char **argv);
int cli_render(int argc, char **argv);
int cli_maps(int argc, char **argv);
int cli_explain(int argc, char **argv);
int cli_povray(int argc, char **argv);

#endif
