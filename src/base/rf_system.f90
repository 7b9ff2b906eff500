!> The operating system: files and folders, terminal, signals, environment. The one file that calls C's library for them (what is in
!> files: rf_stream).
module rf_system
   use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_funptr, c_int, c_int16_t, c_intptr_t, c_null_char, &
      c_null_funptr, c_ptr, c_size_t, c_associated
   use rf_kinds, only: i8
   use rf_stream, only: stream_t, last_error, last_reason, reason_of
   implicit none
   private
   public :: is_terminal, path_exists, is_folder, is_pipe, is_readable, read_whole, make_folders, rename_file, remove_file, &
      link_file, &
      sync_file, sync_folder, real_path, host_name, environment, process_id, exit_program, catch_save_signal, &
      catch_leave_signals, leave_signal, told_to_leave, told_to_save, refuse_large_files, read_ok, read_missing, &
      read_folder, read_refused, read_failed, read_too_large, read_unreachable, largest_file

   !> what read_whole found
   integer, parameter :: read_ok = 0, read_missing = 1, read_folder = 2, read_refused = 3, read_failed = 4, read_too_large = 5, &
      read_unreachable = 6
   !> largest file that read_whole takes [bytes]: offsets into it are default integers
   integer, parameter :: largest_file = 1073741823

   integer(c_int), parameter :: may_exist = 0, may_read = 4
   !> errors (Linux's errno.h): ENOENT, ENOTDIR, EACCES, EINVAL, EOPNOTSUPP
   integer, parameter :: not_there = 2, no_folder = 20, not_permitted = 13, not_for_this = 22, not_supported = 95
   !> numbers of Linux
   integer(c_int), parameter :: signal_hang_up = 1, signal_interrupt = 2, signal_user_1 = 10, signal_terminate = 15, &
      signal_cpu_time = 24, signal_file_size = 25
   !> SIG_IGN of signal.h: the handler that does nothing
   integer(c_intptr_t), parameter :: ignoring = 1_c_intptr_t
   integer, parameter :: longest_path = 4096
   !> statx of Linux (sys/stat.h): relative to the working directory (AT_FDCWD); what kind of file (STATX_TYPE); its answer in
   !> units of 16 bits and the place of the mode in it; S_IFMT, S_IFIFO
   integer(c_int), parameter :: working_folder = -100, type_only = 1
   integer, parameter :: statx_size = 128, statx_mode = 15, kind_bits = int(z'F000'), kind_pipe = int(z'1000')
   integer, parameter :: first_chunk = 65536
   !> permissions of a new folder, cut down by the user's mask: rwxrwxrwx
   integer(c_int), parameter :: folder_mode = 511_c_int
   !> set by the handler, at any moment (module variables: a handler has no other place to write to): the signal that asks to
   !> leave; whether one asked for a checkpoint
   integer(c_int), volatile :: leaving = 0, checkpoint = 0

   interface
      function c_isatty(descriptor) bind(c, name='isatty') result(status)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: status
      end function c_isatty
      function c_access(path, mode) bind(c, name='access') result(status)
         import :: c_int, c_char
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
         integer(c_int) :: status
      end function c_access
      function c_statx(folder, path, flags, mask, about) bind(c, name='statx') result(status)
         import :: c_int, c_int16_t, c_char
         integer(c_int), value :: folder, flags, mask
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int16_t), intent(inout) :: about(*)
         integer(c_int) :: status
      end function c_statx
      function c_opendir(path) bind(c, name='opendir') result(folder)
         import :: c_ptr, c_char
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr) :: folder
      end function c_opendir
      function c_closedir(folder) bind(c, name='closedir') result(status)
         import :: c_int, c_ptr
         type(c_ptr), value :: folder
         integer(c_int) :: status
      end function c_closedir
      function c_mkdir(path, mode) bind(c, name='mkdir') result(status)
         import :: c_int, c_char
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
         integer(c_int) :: status
      end function c_mkdir
      function c_rename(old, new) bind(c, name='rename') result(status)
         import :: c_int, c_char
         character(kind=c_char), intent(in) :: old(*), new(*)
         integer(c_int) :: status
      end function c_rename
      function c_link(old, new) bind(c, name='link') result(status)
         import :: c_int, c_char
         character(kind=c_char), intent(in) :: old(*), new(*)
         integer(c_int) :: status
      end function c_link
      function c_remove(path) bind(c, name='remove') result(status)
         import :: c_int, c_char
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: status
      end function c_remove
      function c_realpath(path, resolved) bind(c, name='realpath') result(place)
         import :: c_ptr, c_char
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(inout) :: resolved(*)
         type(c_ptr) :: place
      end function c_realpath
      function c_gethostname(name, length) bind(c, name='gethostname') result(status)
         import :: c_int, c_char, c_size_t
         character(kind=c_char), intent(inout) :: name(*)
         integer(c_size_t), value :: length
         integer(c_int) :: status
      end function c_gethostname
      function c_getpid() bind(c, name='getpid') result(id)
         import :: c_int
         integer(c_int) :: id
      end function c_getpid
      subroutine c_exit(status) bind(c, name='exit')
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit
      function c_signal(number, handler) bind(c, name='signal') result(old)
         import :: c_int, c_funptr
         integer(c_int), value :: number
         type(c_funptr), value :: handler
         type(c_funptr) :: old
      end function c_signal
   end interface

contains

   !> Whether standard input (0), output (1) or error (2) is a terminal.
   logical function is_terminal(descriptor)
      !> 0, 1 or 2
      integer, intent(in) :: descriptor
      is_terminal = c_isatty(int(descriptor, c_int)) == 1
   end function is_terminal

   !> Whether a file or folder of that name exists.
   logical function path_exists(path)
      !> path of a file or folder
      character(len=*), intent(in) :: path
      path_exists = c_access(path//c_null_char, may_exist) == 0
   end function path_exists

   !> Whether the user may read a file.
   logical function is_readable(path)
      !> path of a file
      character(len=*), intent(in) :: path
      is_readable = c_access(path//c_null_char, may_read) == 0
   end function is_readable

   !> Whether the path is a folder (that may be read).
   logical function is_folder(path)
      !> path of a folder
      character(len=*), intent(in) :: path
      type(c_ptr) :: folder
      integer(c_int) :: status
      folder = c_opendir(path//c_null_char)
      is_folder = c_associated(folder)
      if (is_folder) status = c_closedir(folder)
   end function is_folder

   !> Whether the path is a pipe with a name (a fifo): who opens it waits until somebody writes to it.
   logical function is_pipe(path)
      !> path of a file
      character(len=*), intent(in) :: path
      integer(c_int16_t) :: about(statx_size)
      about = 0
      is_pipe = c_statx(working_folder, path//c_null_char, 0_c_int, type_only, about) == 0
      if (is_pipe) is_pipe = iand(int(about(statx_mode)), kind_bits) == kind_pipe
   end function is_pipe

   !> Read all bytes of a file, a pipe or the standard input.
   subroutine read_whole(path, text, status)
      !> path of the file; empty: the standard input
      character(len=*), intent(in) :: path
      !> its bytes
      character(len=:), allocatable, intent(out) :: text
      !> read_ok, read_missing, read_folder, read_refused, read_failed, read_too_large or read_unreachable
      integer, intent(out) :: status
      type(stream_t) :: file
      integer(i8) :: size_told
      logical :: opened, closed
      text = ''
      size_told = 0
      if (len(path) == 0) then
         opened = file%open_input()
         status = read_failed
      else
         if (.not. path_exists(path)) then
            status = read_unreachable
            if (any(last_error() == [not_there, no_folder])) status = read_missing
            return
         end if
         status = read_folder
         if (is_folder(path)) return
         status = read_refused
         opened = file%open(path, 'r')
         inquire (file=path, size=size_told)
      end if
      if (.not. opened) return
      call read_stream(file, max(size_told, 0_i8), text, status)
      if (len(path) > 0) closed = file%close()
   end subroutine read_whole

   !> Read an open stream to its end; the buffer doubles when the size was not told.
   subroutine read_stream(file, size_told, text, status)
      type(stream_t), intent(inout) :: file
      integer(i8), intent(in) :: size_told
      character(len=:), allocatable, intent(out) :: text
      integer, intent(out) :: status
      character(len=:), allocatable :: buffer, larger
      integer(i8) :: used, got
      status = read_too_large
      text = ''
      if (size_told > int(largest_file, i8)) return
      allocate (character(len=max(size_told + 1_i8, int(first_chunk, i8))) :: buffer)
      used = 0
      do
         got = file%read(buffer(used + 1:))
         if (got <= 0) exit
         used = used + got
         if (used > int(largest_file, i8)) return
         if (used == len(buffer, i8)) then
            allocate (character(len=2*used) :: larger)
            larger(:used) = buffer
            call move_alloc(larger, buffer)
         end if
      end do
      status = merge(read_ok, read_failed, file%is_sound())
      text = buffer(:used)
   end subroutine read_stream

   !> Create a folder and those above it; true when it exists afterwards.
   logical function make_folders(path) result(done)
      !> path of the folder
      character(len=*), intent(in) :: path
      integer :: cut
      integer(c_int) :: status
      do cut = 2, len(path)
         if (path(cut:cut) == '/') status = c_mkdir(path(:cut - 1)//c_null_char, folder_mode)
      end do
      status = c_mkdir(path//c_null_char, folder_mode)
      done = is_folder(path)
   end function make_folders

   !> Rename a file; an older one of the new name is replaced at once. True when done.
   logical function rename_file(old, new, reason) result(done)
      !> present and future path
      character(len=*), intent(in) :: old, new
      !> why it was not done, as the system says it
      character(len=:), allocatable, intent(out), optional :: reason
      done = c_rename(old//c_null_char, new//c_null_char) == 0
      if (.not. done .and. present(reason)) reason = last_reason()
   end function rename_file

   !> Give a file a second name, which must not exist yet. True when done (not every file system can).
   logical function link_file(old, new) result(done)
      !> present and further path
      character(len=*), intent(in) :: old, new
      done = c_link(old//c_null_char, new//c_null_char) == 0
   end function link_file

   !> Delete a file or an empty folder; true when it is gone.
   logical function remove_file(path) result(gone)
      !> path of the file
      character(len=*), intent(in) :: path
      integer(c_int) :: status
      status = c_remove(path//c_null_char)
      gone = .not. path_exists(path)
   end function remove_file

   !> Wait until what was written to a closed or flushed file lies on the disk; true when it does.
   logical function sync_file(path, reason) result(done)
      !> path of the file
      character(len=*), intent(in) :: path
      !> why it does not, as the system says it
      character(len=:), allocatable, intent(out), optional :: reason
      integer :: number
      done = synced(path, 'r+', number)
      if (.not. done .and. present(reason)) reason = reason_of(number)
   end function sync_file

   !> Wait until the names of a folder's files lie on the disk; true when they do, also where the system knows no such thing: a
   !> file system that cannot bring folders to the disk, a folder that may be written to but not read.
   logical function sync_folder(path, reason) result(done)
      !> path of the folder; empty: the working directory
      character(len=*), intent(in) :: path
      !> why they do not, as the system says it
      character(len=:), allocatable, intent(out), optional :: reason
      integer :: number
      if (len(path) == 0) then
         done = synced('.', 'r', number)
      else
         done = synced(path, 'r', number)
      end if
      done = done .or. number == not_permitted .or. number == not_for_this .or. number == not_supported
      if (.not. done .and. present(reason)) reason = reason_of(number)
   end function sync_folder

   logical function synced(path, mode, number) result(done)
      character(len=*), intent(in) :: path, mode
      !> of the error, 0 if there was none
      integer, intent(out) :: number
      type(stream_t) :: file
      logical :: closed
      done = file%open(path, mode)
      if (done) done = file%sync()
      number = 0
      if (.not. done) number = last_error()
      if (file%is_open()) closed = file%close()
   end function synced

   !> Absolute path without links and dots; the path itself if it does not exist.
   function real_path(path) result(resolved)
      !> path of a file or folder
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: resolved
      character(kind=c_char, len=longest_path + 1) :: buffer
      type(c_ptr) :: place
      resolved = path
      buffer = c_null_char
      place = c_realpath(path//c_null_char, buffer)
      if (c_associated(place)) resolved = buffer(:index(buffer, c_null_char) - 1)
   end function real_path

   !> Name of the computer.
   function host_name() result(name)
      character(len=:), allocatable :: name
      character(kind=c_char, len=256) :: buffer
      integer(c_int) :: status
      buffer = c_null_char
      status = c_gethostname(buffer, int(len(buffer) - 1, c_size_t))
      name = 'unknown'
      if (status == 0) name = buffer(:index(buffer, c_null_char) - 1)
   end function host_name

   !> Value of an environment variable; empty if it is not set.
   function environment(name) result(value)
      !> name of the variable
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: value
      integer :: length, status
      call get_environment_variable(name, length=length, status=status)
      if (status /= 0) length = 0
      allocate (character(len=length) :: value)
      if (length > 0) call get_environment_variable(name, value)
   end function environment

   !> Number of this process.
   integer function process_id()
      process_id = int(c_getpid())
   end function process_id

   !> Leave the program with an exit status, quietly; open Fortran units are flushed by their owners or closed here.
   subroutine exit_program(status)
      !> 0 done, other values as docs/deck.md
      integer, intent(in) :: status
      call c_exit(int(status, c_int))
   end subroutine exit_program

   !> From now on SIGUSR1 is remembered instead of ending the program.
   subroutine catch_save_signal()
      call catch(signal_user_1)
   end subroutine catch_save_signal

   !> From now on SIGINT (Ctrl-C), SIGTERM, SIGHUP (the terminal or its connection has gone) and SIGXCPU (ulimit -t; it comes again
   !> every second) are remembered instead of ending the program. A second SIGINT ends it at once.
   subroutine catch_leave_signals()
      call catch(signal_interrupt)
      call catch(signal_terminate)
      call catch(signal_hang_up)
      call catch(signal_cpu_time)
   end subroutine catch_leave_signals

   !> What the caller has told the program to ignore (a shell that runs it in the background: SIGINT; nohup: SIGHUP) stays ignored.
   subroutine catch(number)
      integer(c_int), intent(in) :: number
      type(c_funptr) :: old
      old = c_signal(number, c_funloc(remember))
      if (transfer(old, ignoring) == ignoring) old = c_signal(number, transfer(ignoring, c_null_funptr))
   end subroutine catch

   !> Let a write beyond the user's limit of file sizes (ulimit -f) fail with a reason, as on a full disk, and not end the program.
   subroutine refuse_large_files()
      type(c_funptr) :: old
      old = c_signal(signal_file_size, transfer(ignoring, c_null_funptr))
   end subroutine refuse_large_files

   !> Name of the signal that asks to leave; empty if none has come.
   function leave_signal() result(name)
      character(len=:), allocatable :: name
      select case (leaving)
      case (0); name = ''
      case (signal_interrupt); name = 'SIGINT'
      case (signal_hang_up); name = 'SIGHUP'
      case (signal_cpu_time); name = 'SIGXCPU'
      case default; name = 'SIGTERM'
      end select
   end function leave_signal

   !> Whether a signal has come that asks to leave. Costs nothing.
   logical function told_to_leave()
      told_to_leave = leaving /= 0
   end function told_to_leave

   !> Whether SIGUSR1 has come since it was asked last.
   logical function told_to_save()
      told_to_save = checkpoint /= 0
      if (told_to_save) checkpoint = 0
   end function told_to_save

   !> The handler. It only remembers: at the moment of a signal the program may be anywhere, in a library too.
   subroutine remember(number) bind(c)
      integer(c_int), value :: number
      type(c_funptr) :: old
      if (number == signal_user_1) then
         checkpoint = 1
      else
         leaving = number
         if (number == signal_interrupt) old = c_signal(number, c_null_funptr)      ! SIG_DFL: the next one ends the program
      end if
   end subroutine remember

end module rf_system
