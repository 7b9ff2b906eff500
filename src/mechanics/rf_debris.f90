!> Debris that bears load: pieces that no support and no applied force holds, but contact presses from several sides. What they
!> lack of equilibrium the body lacks (theory: eq. 14).
module rf_debris
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_contact, only: contact_t
   use rf_pieces, only: pieces_t
   use rf_motion, only: motion_t
   implicit none
   private
   public :: debris_t

   !> resultant of the contact forces on a piece, relative to the sum of their magnitudes, up to which they clamp it; above the
   !> second one they push it on
   real(wp), parameter :: clamps = 0.5_wp, pushes = 0.8_wp
   !> growth of the residual from one look at the motion to the next above which it is no creep but flutter
   real(wp), parameter :: flutters = 2.0_wp

   type :: debris_t
      !> the residual of the piece counts; it is held between others and moves as a part of the body, (pieces)
      logical, allocatable :: counts(:), clamped(:)
      !> Rayleigh quotient of the motion between the last two looks at it, not known: huge [-]
      real(wp) :: slow = huge(1.0_wp)
      !> at the last look: displacements [length] and unbalanced forces, without the applied ones [force], (4, nodes); |r| [force]
      real(wp), allocatable, private :: from(:, :)
      real(wp), private :: residual = 0
   contains
      procedure :: begin, look, follow, exchange
   end type debris_t

contains

   !> A relaxation begins: no piece bears anything yet.
   subroutine begin(self, n)
      class(debris_t), intent(inout) :: self
      !> pieces
      integer, intent(in) :: n
      if (allocated(self%counts)) deallocate (self%counts, self%clamped)
      allocate (self%counts(n), self%clamped(n), source=.false.)
      if (allocated(self%from)) deallocate (self%from)
      self%slow = huge(1.0_wp)
   end subroutine begin

   !> Which pieces bear load at the contact forces of the last step. A piece counts from where they are not small, and until
   !> nothing touches it.
   subroutine look(self, contact, pieces, b, limit, changed)
      class(debris_t), intent(inout) :: self
      type(contact_t), intent(in) :: contact
      type(pieces_t), intent(in) :: pieces
      !> factor of the residual in that step's update (contact force = impulse/b)
      real(wp), intent(in) :: b
      !> residual at which a state is taken [force]
      real(wp), intent(in) :: limit
      !> a piece does what it did not before
      logical, intent(out) :: changed
      real(wp), allocatable :: pressed(:), resultant(:, :)
      logical :: before(2)
      real(wp) :: part
      integer :: p
      changed = .false.
      if (contact%n_pairs == 0 .or. all(pieces%supported .or. pieces%loaded)) return
      call add_forces(contact, pieces, b, pressed, resultant)
      do p = 1, pieces%n
         if (pieces%supported(p) .or. pieces%loaded(p)) cycle
         before = [self%counts(p), self%clamped(p)]
         part = merge(pushes, clamps, self%clamped(p))
         self%counts(p) = pressed(p) > merge(0.0_wp, limit, self%counts(p))
         self%clamped(p) = self%counts(p) .and. norm2(resultant(:, p)) <= part*pressed(p)
         changed = changed .or. any(before .neqv. [self%counts(p), self%clamped(p)])
      end do
   end subroutine look

   !> How slowly the body moves as a whole: the quotient of its way and of the change of all forces since the last look. That of
   !> one step (theory: eq. 11) is lost in the chatter of contact where debris creeps.
   subroutine follow(self, n_nodes, contact, motion, b, inverse_mass, paced, residual)
      class(debris_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      type(contact_t), intent(inout) :: contact
      type(motion_t), intent(in) :: motion
      !> see look
      real(wp), intent(in) :: b
      !> 1/m; 1 where the node's motion counts, (nodes)
      real(wp), intent(in) :: inverse_mass(:), paced(:)
      !> |r| of the last step [force]
      real(wp), intent(in) :: residual
      real(wp), allocatable :: now(:, :)
      real(wp) :: curvature, kinetic, way(2)
      integer :: n
      self%slow = huge(1.0_wp)
      if (.not. any(self%clamped)) then
         if (allocated(self%from)) deallocate (self%from)
         return
      end if
      call take(contact, motion, b, n_nodes, now)
      if (allocated(self%from) .and. residual < flutters*self%residual) then
         curvature = 0
         kinetic = 0
         do n = 1, n_nodes
            way = paced(n)*(now(:2, n) - self%from(:2, n))
            curvature = curvature + dot_product(way, now(3:, n) - self%from(3:, n))
            kinetic = kinetic + dot_product(way, way)/inverse_mass(n)
         end do
         if (kinetic > 0) self%slow = abs(curvature)/kinetic
      end if
      call move_alloc(now, self%from)
      self%residual = residual
   end subroutine follow

   !> The state of the last step: see debris_t.
   subroutine take(contact, motion, b, n_nodes, now)
      type(contact_t), intent(inout) :: contact
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: b
      integer, intent(in) :: n_nodes
      real(wp), allocatable, intent(out) :: now(:, :)
      integer :: n
      allocate (now(4, n_nodes))
      do n = 1, n_nodes
         now(:, n) = [motion%ux(n), motion%uy(n), motion%fx(n), motion%fy(n)]
      end do
      call contact%sum_forces(b)
      do n = 1, contact%n_nodes
         now(3:, contact%node(n)) = now(3:, contact%node(n)) - contact%force(:, n)
      end do
   end subroutine take

   !> Forces of other pieces on each piece.
   subroutine add_forces(contact, pieces, b, pressed, resultant)
      type(contact_t), intent(in) :: contact
      type(pieces_t), intent(in) :: pieces
      real(wp), intent(in) :: b
      !> sum of their magnitudes, (pieces), and their resultant, (2, pieces) [force]
      real(wp), allocatable, intent(out) :: pressed(:), resultant(:, :)
      real(wp) :: pull(2), force(2)
      integer :: i, p, q
      allocate (pressed(pieces%n), resultant(2, pieces%n), source=0.0_wp)
      do i = 1, contact%n_pairs
         p = pieces%of_node(contact%pair(1, i))
         q = pieces%of_node(contact%pair(2, i))
         if (p == q) cycle
         pull = contact%traction(i, b)
         force = contact%normal(:, i)*pull(1) + [-contact%normal(2, i), contact%normal(1, i)]*pull(2)
         pressed([p, q]) = pressed([p, q]) + norm2(force)
         resultant(:, p) = resultant(:, p) - force
         resultant(:, q) = resultant(:, q) + force
      end do
   end subroutine add_forces

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(debris_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('counts', self%counts)
      call archive%exchange('clamped', self%clamped)
      call archive%exchange('slow', self%slow)
      call archive%exchange('from', self%from)
      call archive%exchange('residual', self%residual)
   end subroutine exchange

end module rf_debris
