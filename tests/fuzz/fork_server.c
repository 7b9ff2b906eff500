/* Many runs of a program for the price of one start: a start of the sanitizer build costs three times the run of a small
   deck. Loaded before the program (LD_PRELOAD), this takes hold of its `main`. Whatever is read on descriptor FORK_SERVER
   is a run: a fork of the process, loaded and linked but with nothing done yet, goes to the folder given and calls the true
   main. So each run has a process of its own, with its own limits and its own end.

   Request: one line, fields separated by '\t': folder, file for standard input, and the arguments.
   Standard output and error go to the files `output` and `error` in that folder's parent.
   Answer: one line, the status of waitpid and the largest memory in MB. Closing the descriptor ends the server. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { most_arguments = 32, longest = 8192, poll_ms = 20 };
typedef int main_t(int, char **, char **);
static main_t *true_main;

static long number(const char *name) { return atol(getenv(name)); }

/* A limit as `ulimit` sets it; the hard one is a second later. */
static void limit(int resource, rlim_t value, rlim_t hard) {
   struct rlimit both = {value, hard};
   setrlimit(resource, &both);
}

static void redirect(const char *name, int flags, int descriptor) {
   int file = open(name, flags, 0600);
   if (file < 0) _exit(126);
   dup2(file, descriptor);
   close(file);
}

/* The run itself, in the forked process. */
static int run(char *line, char **environment) {
   char *argument[most_arguments + 1] = {"rfem"}, *rest = line, *folder = strsep(&rest, "\t"), *input = strsep(&rest, "\t");
   int n = 1;
   while (rest && n < most_arguments) argument[n++] = strsep(&rest, "\t");
   close(number("FORK_SERVER"));
   close(number("FORK_SERVER") + 1);
   if (chdir(folder)) _exit(126);
   redirect(input, O_RDONLY, 0);
   redirect("../output", O_WRONLY | O_CREAT | O_TRUNC, 1);
   redirect("../error", O_WRONLY | O_CREAT | O_TRUNC, 2);
   limit(RLIMIT_CORE, 0, 0);
   limit(RLIMIT_CPU, number("FORK_SECONDS"), number("FORK_SECONDS") + 1);
   unsetenv("LD_PRELOAD");
   return true_main(n, argument, environment);
}

/* Memory that a process has in use [MB]. */
static long resident(pid_t process) {
   char name[64];
   long pages = 0;
   snprintf(name, sizeof name, "/proc/%d/statm", (int)process);
   FILE *file = fopen(name, "r");
   if (!file) return 0;
   if (fscanf(file, "%*d %ld", &pages) != 1) pages = 0;
   fclose(file);
   return pages * sysconf(_SC_PAGESIZE) / 1048576;
}

/* Wait for a run; one that takes too much memory or time is ended. */
static int wait_for(pid_t process, long *megabytes) {
   int status;
   struct rusage usage;
   sigset_t child;
   struct timespec pause = {poll_ms / 1000, poll_ms % 1000 * 1000000L};
   time_t end = time(NULL) + number("FORK_WALL_SECONDS");
   sigemptyset(&child);
   sigaddset(&child, SIGCHLD);
   while (wait4(process, &status, WNOHANG, &usage) == 0) {
      if (resident(process) > number("FORK_MEGABYTES")) kill(process, SIGABRT);
      if (time(NULL) > end) kill(process, SIGKILL);
      sigtimedwait(&child, NULL, &pause);
   }
   *megabytes = usage.ru_maxrss / 1024;
   return status;
}

static int serve(int argc, char **argv, char **environment) {
   static char line[longest];
   FILE *requests = fdopen(number("FORK_SERVER"), "r");
   sigset_t child;
   (void)argc, (void)argv;
   if (!requests) return 126;
   while (fgets(line, sizeof line, requests)) {
      line[strcspn(line, "\n")] = 0;
      sigemptyset(&child);
      sigaddset(&child, SIGCHLD);
      sigprocmask(SIG_BLOCK, &child, NULL);
      pid_t process = fork();
      if (process == 0) {
         sigprocmask(SIG_UNBLOCK, &child, NULL);
         return run(line, environment);
      }
      if (process < 0) return 125;
      long megabytes;
      int status = wait_for(process, &megabytes);
      dprintf(number("FORK_SERVER") + 1, "%d %ld\n", status, megabytes);
   }
   _exit(0);
}

/* The C library's start calls this with the program's main. */
int __libc_start_main(main_t *start, int argc, char **argv, main_t *init, void (*fini)(void), void (*rtld_fini)(void), void *stack) {
   int (*next)(main_t *, int, char **, main_t *, void (*)(void), void (*)(void), void *) = dlsym(RTLD_NEXT, "__libc_start_main");
   true_main = start;
   return next(getenv("FORK_SERVER") ? serve : start, argc, argv, init, fini, rtld_fini, stack);
}
