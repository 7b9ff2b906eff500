!> Cracks that soften (`*SOFTENING`): what each pair of nodes knows of its cohesive law, kept over splits, and the energy
!> that it costs (theory: eqs. 23a to 23d). rf_cohesive_k holds the law.
module rf_cohesive
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_renumber, only: carry
   implicit none
   private
   public :: cohesive_t

   !> jump, in units of the critical one, that is round-off of the displacements: it has no direction
   real(wp), parameter :: round_off = 1.0e-9_wp

   type :: cohesive_t
      !> area that softens [length^2]; 0: the pair is brittle, (pairs)
      real(wp), allocatable :: area(:)
      !> fracture energy [energy/length^2] and strength [stress] of opening and slip, (2, pairs)
      real(wp), allocatable :: energy(:, :), strength(:, :)
      !> largest separation of any accepted state; the present one [-], (pairs)
      real(wp), allocatable :: damage(:), separation(:)
      !> the pair was born by the last split and bears all that holds it together, for one step
      logical, allocatable :: rigid(:)
      !> cohesive part of the impulses of the last step, (2, pairs)
      real(wp), allocatable :: impulse(:, :)
      !> the pair has cohesion left; force of the full strength [force], jump at which nothing is left [length]
      logical, allocatable :: bonded(:)
      real(wp), allocatable :: cap(:, :), critical(:, :)
      !> jump at the last accepted state, opening and slip [length], (2, pairs)
      real(wp), allocatable :: jump(:, :)
      !> first pair whose law is too steep for its elements, in opening and in slip (0: none; theory: eq. 23e)
      integer :: steep(2) = 0
      !> energy dissipated so far, energy that the jumps of the last accepted state would give back [force length]
      real(wp) :: dissipated = 0, stored = 0
   contains
      procedure :: reserve, permute, keep, start, inherit, weigh, release, settle, take_stock, work, is_held
      procedure :: exchange
   end type cohesive_t

contains

   subroutine reserve(self, n)
      class(cohesive_t), intent(inout) :: self
      !> pairs that must fit
      integer, intent(in) :: n
      call grow(self%area, n)
      call grow(self%energy, n, 2)
      call grow(self%strength, n, 2)
      call grow(self%damage, n)
      call grow(self%separation, n)
      call grow(self%rigid, n)
      call grow(self%impulse, n, 2)
      call grow(self%bonded, n)
      call grow(self%cap, n, 2)
      call grow(self%critical, n, 2)
      call grow(self%jump, n, 2)
   end subroutine reserve

   !> Put what the segments say of the pairs into another order.
   subroutine permute(self, order)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: order(:)
      integer :: n
      n = size(order)
      self%area(:n) = self%area(order)
      self%energy(:, :n) = self%energy(:, order)
      self%strength(:, :n) = self%strength(:, order)
   end subroutine permute

   !> Only some pairs stay, in a new order.
   subroutine keep(self, stay)
      class(cohesive_t), intent(inout) :: self
      !> their present numbers
      integer, intent(in) :: stay(:)
      call carry(self%area, stay)
      call carry(self%energy, stay)
      call carry(self%strength, stay)
      call carry(self%damage, stay)
      call carry(self%separation, stay)
      call carry(self%rigid, stay)
      call carry(self%impulse, stay)
      call carry(self%bonded, stay)
      call carry(self%cap, stay)
      call carry(self%critical, stay)
      call carry(self%jump, stay)
   end subroutine keep

   !> A new pair: undamaged.
   subroutine start(self, p, rigid)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: p
      !> it bears all that holds it together, until the first step is done
      logical, intent(in) :: rigid
      self%rigid(p) = rigid .and. self%area(p) > 0
      self%damage(p) = 0
      self%separation(p) = 0
      self%impulse(:, p) = 0
      self%jump(:, p) = 0
      self%bonded(p) = self%area(p) > 0
   end subroutine start

   !> A pair that was there before, or one on a crack that was: the mean of what its ancestors know. An end at which the
   !> crack was not open yet counts as undamaged.
   subroutine inherit(self, p, old, from)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: p
      type(cohesive_t), intent(in) :: old
      !> pairs of the old ones, 0: none, at least one of them is not
      integer, intent(in) :: from(:)
      integer :: i
      call self%start(p, .false.)
      do i = 1, size(from)
         if (from(i) == 0) cycle
         self%damage(p) = self%damage(p) + min(1.0_wp, old%damage(from(i)))/size(from)
         self%separation(p) = self%separation(p) + old%separation(from(i))/size(from)
         self%jump(:, p) = self%jump(:, p) + old%jump(:, from(i))/size(from)
      end do
      self%bonded(p) = self%area(p) > 0 .and. self%damage(p) < 1
   end subroutine inherit

   !> Forces and lengths of the laws, for the pairs there are.
   subroutine weigh(self, n_pairs, weight)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: n_pairs
      !> jumps that unit forces make in a step, normal and tangential [length/force], (2, pairs)
      real(wp), intent(in) :: weight(:, :)
      real(wp) :: steepness(2)
      integer :: p
      self%steep = 0
      do p = 1, n_pairs
         self%bonded(p) = self%area(p) > 0 .and. self%damage(p) < 1
         if (.not. self%bonded(p)) then
            self%impulse(:, p) = 0
            self%separation(p) = max(1.0_wp, self%damage(p))
            cycle
         end if
         self%cap(:, p) = self%area(p)*self%strength(:, p)
         self%critical(:, p) = 2*self%energy(:, p)/self%strength(:, p)
         steepness = weight(:, p)*self%cap(:, p)/self%critical(:, p)
         where (self%steep == 0 .and. steepness >= 1) self%steep = p
      end do
   end subroutine weigh

   !> The first step after a split is done, in which new pairs bore all that held them together, so that no force jumped.
   !> From now on they bear their strength.
   subroutine release(self, n_pairs)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: n_pairs
      self%rigid(:n_pairs) = .false.
   end subroutine release

   !> A converged state is accepted: the separation reached counts from here on, what that cost is booked.
   subroutine settle(self, p, jump)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: p
      !> opening and slip [length]
      real(wp), intent(in) :: jump(2)
      real(wp) :: reached
      if (.not. self%bonded(p)) return
      reached = min(1.0_wp, self%separation(p))
      if (reached > self%damage(p)) then
         self%dissipated = self%dissipated + self%area(p)*(reached - self%damage(p))* &
                           0.5_wp*(mixed(self, p, self%jump(:, p), jump) + mixed(self, p, jump, jump))
         self%damage(p) = reached
         self%bonded(p) = reached < 1
      end if
      self%jump(:, p) = jump
      self%stored = self%stored + stored_by(self, p)
   end subroutine settle

   !> What a damaged pair gives back when it unloads [force length].
   pure real(wp) function stored_by(self, p)
      type(cohesive_t), intent(in) :: self
      integer, intent(in) :: p
      stored_by = 0
      if (self%damage(p) > 0) stored_by = self%area(p)*(1/self%damage(p) - 1)* &
                                          sum(self%energy(:, p)*(relative(self, p, self%jump(:, p)))**2)
   end function stored_by

   !> Pairs were taken out of the body: only what is left stores something. After rebuilding the pairs.
   subroutine take_stock(self, n_pairs)
      class(cohesive_t), intent(inout) :: self
      integer, intent(in) :: n_pairs
      integer :: p
      self%stored = 0
      do p = 1, n_pairs
         if (.not. self%bonded(p)) cycle
         self%critical(:, p) = 2*self%energy(:, p)/self%strength(:, p)
         self%stored = self%stored + stored_by(self, p)
      end do
   end subroutine take_stock

   !> Jump in units of the critical one; pressed faces have no opening [-].
   pure function relative(self, p, jump)
      type(cohesive_t), intent(in) :: self
      integer, intent(in) :: p
      real(wp), intent(in) :: jump(2)
      real(wp) :: relative(2)
      relative = [max(0.0_wp, jump(1)), jump(2)]/self%critical(:, p)
   end function relative

   !> Fracture energy of the mode of a jump (of another where there is none: in the first time step after a split new faces keep
   !> together but for round-off) [energy/length^2].
   pure real(wp) function mixed(self, p, jump, other)
      type(cohesive_t), intent(in) :: self
      integer, intent(in) :: p
      real(wp), intent(in) :: jump(2), other(2)
      real(wp) :: x(2)
      x = relative(self, p, jump)
      if (.not. norm2(x) > round_off) x = relative(self, p, other)
      mixed = self%energy(1, p)
      if (any(abs(x) > 0)) mixed = sum(self%energy(:, p)*(x/norm2(x))**2)
   end function mixed

   !> Work done against cohesion up to the last accepted state [force length].
   pure real(wp) function work(self)
      class(cohesive_t), intent(in) :: self
      work = self%dissipated + self%stored
   end function work

   !> Whether cohesion holds a pair together: nothing has moved there yet.
   pure logical function is_held(self, p)
      class(cohesive_t), intent(in) :: self
      integer, intent(in) :: p
      is_held = self%bonded(p) .and. .not. (self%separation(p) > 0)
   end function is_held

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(cohesive_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('area', self%area)
      call archive%exchange('energy', self%energy)
      call archive%exchange('strength', self%strength)
      call archive%exchange('damage', self%damage)
      call archive%exchange('separation', self%separation)
      call archive%exchange('rigid', self%rigid)
      call archive%exchange('impulse', self%impulse)
      call archive%exchange('bonded', self%bonded)
      call archive%exchange('cap', self%cap)
      call archive%exchange('critical', self%critical)
      call archive%exchange('jump', self%jump)
      call archive%exchange_fixed('steep', self%steep)
      call archive%exchange('dissipated', self%dissipated)
      call archive%exchange('stored', self%stored)
   end subroutine exchange

end module rf_cohesive
