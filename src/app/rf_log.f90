!> What a run says while it goes: the log on standard output, the progress line on standard error.
module rf_log
   use, intrinsic :: iso_fortran_env, only: error_unit
   use rf_kinds, only: wp
   use rf_model, only: model_t
   use rf_position, only: position_t, frame_start, frame_before_event, frame_after_event, frame_settled, frame_not_converged
   use rf_recorder, only: recorder_t
   use rf_clock, only: monotonic_time
   use rf_stream, only: stream_t, last_reason
   use rf_system, only: is_terminal
   use rf_text, only: to_text
   implicit none
   private
   public :: log_t, short

   !> descriptor of standard error
   integer, parameter :: error_descriptor = 2
   !> seconds between two live lines, part of the run between two plain ones
   real(wp), parameter :: live_interval = 0.2_wp, plain_part = 0.05_wp
   !> rows of the table between two headings
   integer, parameter :: rows_a_heading = 40
   !> words of the kinds of states
   character(len=13), parameter :: kind_words(0:4) = [character(len=13) :: 'start', 'before event', 'after event', 'settled', &
                                                      'not converged']

   type :: log_t
      !> no progress line
      logical :: quiet = .false.
      !> lines could not be written to standard output
      logical :: lost = .false.
      type(stream_t), private :: file
      integer, private :: rows = 0
      logical, private :: live = .false., asked = .false.
      real(wp), private :: last_shown = -huge(1.0_wp), last_part = -1
   contains
      procedure :: begin, line, row, progress, end_progress
      procedure, private :: lose
   end type log_t

contains

   !> A number with four digits.
   function short(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(es12.4)') value
      if (abs(value) >= 0.01_wp .and. abs(value) < 99999.5_wp) write (buffer, '(f16.4)') value
      text = trim(adjustl(buffer))
   end function short

   !> Take the standard output, before any file is opened: one that is closed would get its number. (It is written as a stream of
   !> C's because gfortran's units keep quiet about a full disk.)
   subroutine begin(self)
      class(log_t), intent(inout) :: self
      if (.not. self%file%open_output()) call self%lose(last_reason())
   end subroutine begin

   !> A line of the log, or several.
   subroutine line(self, text)
      class(log_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      logical :: good
      if (.not. self%file%is_open()) return
      good = self%file%write(text//new_line('a'))
      if (good) good = self%file%flush()
      if (.not. good) call self%lose(last_reason())
   end subroutine line

   !> Lines are lost: told once. Results matter more than the log, so the run goes on.
   subroutine lose(self, reason)
      class(log_t), intent(inout) :: self
      character(len=*), intent(in) :: reason
      if (.not. self%lost) write (error_unit, '(a)') 'rfem: error: cannot write to standard output: '//reason// &
         '; lines of it are lost, and the exit status is 3 where it would be 0'
      flush (error_unit)
      self%lost = .true.
   end subroutine lose

   !> A row of the table: one for each history row.
   subroutine row(self, model, position, kind, recorder)
      class(log_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      integer, intent(in) :: kind
      type(recorder_t), intent(in) :: recorder
      character(len=160) :: text
      if (mod(self%rows, rows_a_heading) == 0) then
         call self%line('')
         call self%line('  step   inc  load factor  events  cracks  fragments  iterations  residual  utilisation'// &
            '    monitor u1    monitor u2   monitor rf1   monitor rf2  state')
      end if
      self%rows = self%rows + 1
      associate (figures => recorder%history%figures)
         write (text, '(i6,i6,f13.6,i8,i8,i11,i12,es10.2,f13.4,4es14.5,2x,a)') position%step, position%increment, &
            position%load_factor, model%events, figures%cracks, model%pieces%n, figures%iterations, &
            model%relaxation%residual, min(model%failure%largest, 99999.0_wp), figures%u, figures%force, trim(kind_words(kind))
      end associate
      call self%line(trim(text))
   end subroutine row

   !> The progress line: live on a terminal, a plain line every few per cent elsewhere.
   subroutine progress(self, model, position, increments, steps)
      class(log_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      !> of the present step; in all
      integer, intent(in) :: increments, steps
      real(wp) :: part
      character(len=120) :: text
      if (self%quiet) return
      if (.not. self%asked) self%live = is_terminal(error_descriptor)
      self%asked = .true.
      part = (position%step - 1 + real(position%increment, wp)/max(1, increments))/steps
      if (self%live) then
         if (monotonic_time() - self%last_shown < live_interval) return
      else if (part < self%last_part + plain_part) then
         return
      end if
      self%last_shown = monotonic_time()
      self%last_part = part
      write (text, '(a,i4,a,i0,a,i0,a,i0,a,i0,a)') 'rfem: ', int(100*part), ' %  step ', position%step, ', increment ', &
         position%increment, ', ', model%events, ' events, ', model%mesh%n_elements, ' elements'
      if (self%live) then
         write (error_unit, '(3a)', advance='no') achar(13), trim(text), achar(27)//'[K'
      else
         write (error_unit, '(a)') trim(text)
      end if
      flush (error_unit)
   end subroutine progress

   !> Leave the live line.
   subroutine end_progress(self)
      class(log_t), intent(in) :: self
      if (self%live .and. .not. self%quiet) write (error_unit, '(a)') ''
   end subroutine end_progress

end module rf_log
