!> The command line of rfem (docs/deck.md).
module rf_command_line
   use rf_text, only: text_t, did_you_mean, same_text, split, squeezed, upper
   use rf_number, only: read_integer
   implicit none
   private
   public :: options_t, read_command_line, usage_text

   !> what the user asks for
   integer, parameter, public :: action_run = 0, action_check = 1, action_explain = 2, action_help = 3, action_version = 4

   type :: options_t
      integer :: action = action_run
      !> the deck; empty: standard input
      character(len=:), allocatable :: deck
      !> empty where not given
      character(len=:), allocatable :: job, output
      !> checkpoint to go on from; empty: none
      character(len=:), allocatable :: restart
      !> 0: OMP_NUM_THREADS, else all cores
      integer :: threads = 0
      logical :: quiet = .false.
      !> NAME=VALUE of --set
      type(text_t), allocatable :: overrides(:)
      !> what is wrong; not allocated: nothing
      character(len=:), allocatable :: error
   end type options_t

   character(len=*), parameter :: lf = new_line('a')
   character(len=*), parameter :: usage_text = &
      'usage: rfem [options] case.inp        or   rfem [options] < case.inp'//lf// &
      '       rfem [--threads N] [--quiet] --restart JOB.rst.h5'//lf//lf// &
      'Finite elements for the failure of rock: reads a keyword deck (docs/deck.md), writes'//lf// &
      'JOB.vtkhdf, JOB_cracks.vtkhdf, JOB.h5, JOB_history.csv and JOB_events.csv (docs/results.md).'//lf//lf// &
      '  --job NAME        prefix of all result files (default: *JOB, else the deck''s file name, else rfem)'//lf// &
      '  --output DIR      where results go (default: the working directory; created if missing)'//lf// &
      '  --threads N       OpenMP threads (default: OMP_NUM_THREADS, else all cores)'//lf// &
      '  --set NAME=VALUE  override a *PARAMETER (may be repeated)'//lf// &
      '  --check           parse, build the mesh, report, run nothing'//lf// &
      '  --explain         print every setting with its value and where it came from, run nothing'//lf// &
      '  --restart FILE    go on from a checkpoint, JOB.rst.h5; no deck is read (it is inside)'//lf// &
      '  --quiet           no progress line'//lf// &
      '  --help            this text'//lf// &
      '  --version         version, commit and compiler'//lf//lf// &
      'exit status: 0 done, 1 the simulation failed, 2 deck or command line wrong, 3 a file could not be'//lf// &
      'written or reading failed, 4 stopped by a signal or the wall-clock limit, checkpoint written'
   !> options that take a value, that take none, and that may be given more than once
   character(len=*), parameter :: with_value = '--job --output --threads --set --restart', &
      without_value = '--check --explain --quiet --help --version', repeatable = '--set'
   !> most threads that may be asked for
   integer, parameter :: most_threads = 1024

contains

   !> Read the arguments. The first thing that is wrong ends it: of an option that is given twice nobody knows which was meant.
   subroutine read_command_line(options, first)
      type(options_t), intent(out) :: options
      !> the first one that is the program's
      integer, intent(in) :: first
      character(len=:), allocatable :: word, given
      integer :: i
      allocate (options%overrides(0))
      options%deck = ''
      options%job = ''
      options%output = ''
      options%restart = ''
      given = ''
      i = first
      do while (i <= command_argument_count() .and. .not. allocated(options%error))
         word = argument(i)
         i = i + 1
         if (index(word, '-') == 1 .and. len(word) > 1) then
            call take_option(options, word, i, given)
            cycle
         end if
         if (len(options%deck) > 0) then
            options%error = 'two decks: '//options%deck//' and '//word//'; one run takes one'
         else if (len(word) == 0) then
            options%error = 'the name of the deck is empty'
         end if
         options%deck = word
      end do
      if (len(options%restart) > 0 .and. .not. allocated(options%error)) call check_restart(options)
   end subroutine read_command_line

   !> Take an option: --quiet, --job NAME or --job=NAME.
   subroutine take_option(options, word, next, given)
      type(options_t), intent(inout) :: options
      !> the argument
      character(len=*), intent(in) :: word
      !> the argument after it; moved on if it is the value
      integer, intent(inout) :: next
      !> names of the options so far
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable :: name
      integer :: cut
      name = word
      cut = index(word, '=')
      if (cut > 0) then
         if (is_among(with_value, word(:cut - 1))) name = word(:cut - 1)
      end if
      if (is_among(given, name) .and. .not. is_among(repeatable, name)) then
         options%error = name//' is given twice; see rfem --help'
      else if (is_among(without_value, name)) then
         call take_flag(options, name)
      else if (.not. is_among(with_value, name)) then
         options%error = name//' is no option'//nearest(name)//'; see rfem --help'
      else if (len(name) < len(word)) then
         call take_value(options, name, word(cut + 1:))
      else if (next > command_argument_count()) then
         options%error = name//' needs a value; see rfem --help'
      else
         call take_value(options, name, argument(next))
         next = next + 1
      end if
      given = given//' '//name
   end subroutine take_option

   !> What --restart goes together with: all that the run is stands in the checkpoint.
   subroutine check_restart(options)
      type(options_t), intent(inout) :: options
      if (len(options%deck) > 0) then
         options%error = '--restart reads no deck, and '//options%deck//' is one: the deck is in the checkpoint'
      else if (len(options%job) > 0 .or. len(options%output) > 0) then
         options%error = '--restart goes on with the result files that lie beside the checkpoint: no --job, no --output'
      else if (size(options%overrides) > 0) then
         options%error = '--restart goes on with the settings of the run that was interrupted: no --set'
      else if (options%action == action_check) then
         options%error = '--restart goes on with a run: no --check'
      end if
   end subroutine check_restart

   function nearest(word) result(hint)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: hint
      type(text_t), allocatable :: known(:)
      call split(with_value//' '//without_value, known)
      hint = did_you_mean(word, known)
   end function nearest

   function argument(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(i, length=length)
      allocate (character(len=length) :: text)
      if (length > 0) call get_command_argument(i, text)
   end function argument

   pure logical function is_among(list, word)
      character(len=*), intent(in) :: list, word
      is_among = index(' '//list//' ', ' '//word//' ') > 0
   end function is_among

   subroutine take_flag(options, word)
      type(options_t), intent(inout) :: options
      character(len=*), intent(in) :: word
      select case (word)
      case ('--check'); options%action = max(options%action, action_check)
      case ('--explain'); options%action = max(options%action, action_explain)
      case ('--help'); options%action = action_help
      case ('--version'); options%action = action_version
      case ('--quiet'); options%quiet = .true.
      end select
   end subroutine take_flag

   subroutine take_value(options, word, value)
      type(options_t), intent(inout) :: options
      character(len=*), intent(in) :: word, value
      type(text_t), allocatable :: longer(:)
      integer :: status, i
      select case (word)
      case ('--job')
         if (len_trim(value) == 0 .or. index(value, '/') > 0) then
            options%error = '--job '//value//': a job name is not empty and has no /; --output names the folder'
         end if
         options%job = value
      case ('--output')
         if (len_trim(value) == 0) options%error = '--output needs the name of a folder'
         options%output = value
      case ('--threads')
         call read_integer(value, options%threads, status)
         if (status /= 0 .or. options%threads < 1 .or. options%threads > most_threads) &
            options%error = '--threads '//value//': a whole number from 1 to 1024 is needed'
      case ('--set')
         if (index(value, '=') < 2) options%error = '--set '//value//': NAME=VALUE is needed'
         do i = 1, size(options%overrides)
            if (same_text(name_of(options%overrides(i)%s), name_of(value))) &
               options%error = '--set '//name_of(value)//' is given twice: '//options%overrides(i)%s//' and '//value
         end do
         allocate (longer(size(options%overrides) + 1))
         do i = 1, size(options%overrides)
            longer(i)%s = options%overrides(i)%s
         end do
         longer(size(longer))%s = value
         call move_alloc(longer, options%overrides)
      case ('--restart')
         if (len_trim(value) == 0) options%error = '--restart needs the name of a checkpoint, JOB.rst.h5'
         options%restart = value
      end select
   end subroutine take_value

   !> The name in the NAME=VALUE of a --set, as decks compare names.
   pure function name_of(setting) result(name)
      character(len=*), intent(in) :: setting
      character(len=:), allocatable :: name
      name = upper(squeezed(setting(:max(0, index(setting, '=') - 1))))
   end function name_of

end module rf_command_line
