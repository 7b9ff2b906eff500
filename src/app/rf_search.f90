!> The search for the load at which an increment's first event happens: false position in the Illinois form (theory: eq. 36).
module rf_search
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_model, only: model_t
   use rf_snapshot, only: snapshot_t
   implicit none
   private
   public :: search_t

   !> trial loads
   integer, parameter :: most_trials = 40
   !> a bracket is closed when its ends are neighbours, in units of the spacing of numbers near 1
   real(wp), parameter :: closed = 4.0_wp

   type :: search_t
      !> equilibrium at the increment's end, where too much fails
      type(snapshot_t) :: beyond
      !> load at which the body is tried now: part of the step [-]
      real(wp) :: trial = 0
      !> the bracket: parts of the step below and above the load sought, and largest utilisation less the one sought there
      real(wp), private :: low = 0, high = 0, f_low = 0, f_high = 0
      !> end of the bracket that moved last (-1 low, 1 high); trials so far
      integer, private :: side = 0, trials = 0
      !> the trial is taken whatever it shows
      logical, private :: final = .false.
   contains
      procedure :: begin, judge, exchange
      procedure, private :: next
   end type search_t

contains

   !> Begin between the last equilibrium and the present one.
   subroutine begin(self, model, low, high, at_low, overshoot)
      class(search_t), intent(inout) :: self
      !> at the increment's end
      type(model_t), intent(in) :: model
      !> parts of the step at the increment's start and end [-]
      real(wp), intent(in) :: low, high
      !> largest utilisation at its start; by how much the utilisation sought may exceed 1 [-]
      real(wp), intent(in) :: at_low, overshoot
      call self%beyond%take(model)
      self%beyond%fraction = high
      self%low = low
      self%high = high
      self%f_low = at_low - (1 + 0.5_wp*overshoot)
      self%f_high = model%failure%largest - (1 + 0.5_wp*overshoot)
      self%side = 0
      self%trials = 0
      self%final = .false.
      call self%next()
   end subroutine begin

   !> The load of the next trial.
   subroutine next(self)
      class(search_t), intent(inout) :: self
      self%final = self%trials == most_trials .or. (self%trials > 0 .and. self%high - self%low <= closed*epsilon(1.0_wp))
      if (self%final) then
         ! the utilisation jumps over the band (the paper's criterion does): the first load at which it is above
         self%trial = self%high
         return
      end if
      self%trials = self%trials + 1
      self%trial = (self%low*self%f_high - self%high*self%f_low)/(self%f_high - self%f_low)
      if (.not. (self%trial > self%low .and. self%trial < self%high)) self%trial = 0.5_wp*(self%low + self%high)
   end subroutine next

   !> Look at what the trial shows: it is the load sought, or the bracket closes and there is another trial.
   subroutine judge(self, largest, overshoot, found)
      class(search_t), intent(inout) :: self
      !> largest utilisation at the trial load; by how much the one sought may exceed 1 [-]
      real(wp), intent(in) :: largest, overshoot
      logical, intent(out) :: found
      real(wp) :: f
      f = largest - (1 + 0.5_wp*overshoot)
      found = self%final .or. abs(f) <= 0.5_wp*overshoot
      if (found) then
         call self%beyond%forget()
         return
      end if
      if (f > 0) then
         self%high = self%trial
         self%f_high = f
         if (self%side == 1) self%f_low = 0.5_wp*self%f_low
         self%side = 1
      else
         self%low = self%trial
         self%f_low = f
         if (self%side == -1) self%f_high = 0.5_wp*self%f_high
         self%side = -1
      end if
      call self%next()
   end subroutine judge

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(search_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%enter('beyond')
      call self%beyond%exchange(archive)
      call archive%leave()
      call archive%exchange('trial', self%trial)
      call archive%exchange('low', self%low)
      call archive%exchange('high', self%high)
      call archive%exchange('f_low', self%f_low)
      call archive%exchange('f_high', self%f_high)
      call archive%exchange('side', self%side)
      call archive%exchange('trials', self%trials)
      call archive%exchange('final', self%final)
   end subroutine exchange

end module rf_search
