!> Named sets of nodes or of elements: one table for each kind. While the deck is read, members come as entries (the
!> place of a node or element in the deck), as runs of entries, or as the name of another set, which may be defined
!> later; close_table resolves those. The result is one bit per set and entry.
module rf_sets
   use rf_kinds, only: wp, i1
   use rf_grow, only: grow
   use rf_text, only: text_t, add_text, did_you_mean, same_text
   use rf_diagnostics, only: place_t, diagnostics_t
   use rf_mesh, only: sets_in_a_word
   implicit none
   private
   public :: set_table_t, in_box, in_ring, nearest_point

   type :: set_table_t
      !> 'node' or 'element', for messages
      character(len=7) :: kind = 'node'
      !> sets so far, their names (capitals)
      integer :: n = 0
      type(text_t), allocatable :: name(:)
      !> where each was first defined
      type(place_t), allocatable :: place(:)
      !> runs of members: (set, first entry, last entry)
      integer :: n_runs = 0
      integer, allocatable, private :: run(:, :)
      !> sets named as members: in which set, by which name, where
      integer :: n_references = 0
      integer, allocatable, private :: referring(:)
      type(text_t), allocatable, private :: referred(:)
      type(place_t), allocatable, private :: reference_place(:)
   contains
      procedure :: define, find, add_entry, add_run, add_reference, close_table, membership, nearest_name
   end type set_table_t

contains

   !> Number of the set of a name; the set is made if there is none yet.
   integer function define(self, name, place) result(set)
      class(set_table_t), intent(inout) :: self
      !> its name, in capitals
      character(len=*), intent(in) :: name
      !> where the deck defines it
      type(place_t), intent(in) :: place
      set = self%find(name)
      if (set > 0) return
      call add_text(self%name, self%n, name)
      set = self%n
      call put_place(self%place, set, place)
   end function define

   !> Number of a set; 0 if no set has that name.
   pure integer function find(self, name) result(set)
      class(set_table_t), intent(in) :: self
      !> its name, in capitals
      character(len=*), intent(in) :: name
      do set = self%n, 1, -1
         if (same_text(self%name(set)%s, name)) return
      end do
      set = 0
   end function find

   !> '; did you mean X?' for a name that no set has, or nothing.
   pure function nearest_name(self, name) result(text)
      class(set_table_t), intent(in) :: self
      !> what was written
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      text = ''
      if (self%n > 0) text = did_you_mean(name, self%name(:self%n))
   end function nearest_name

   !> One more member. Members that come one after the other make one run.
   subroutine add_entry(self, set, entry)
      class(set_table_t), intent(inout) :: self
      !> the set; the node or element
      integer, intent(in) :: set, entry
      if (self%n_runs > 0) then
         if (self%run(1, self%n_runs) == set .and. self%run(3, self%n_runs) == entry - 1) then
            self%run(3, self%n_runs) = entry
            return
         end if
      end if
      call self%add_run(set, entry, entry)
   end subroutine add_entry

   !> All entries from the first to the last become members (none if the last comes before the first).
   subroutine add_run(self, set, first, last)
      class(set_table_t), intent(inout) :: self
      !> the set; first and last entry
      integer, intent(in) :: set, first, last
      if (last < first) return
      self%n_runs = self%n_runs + 1
      call grow(self%run, self%n_runs, 3)
      self%run(:, self%n_runs) = [set, first, last]
   end subroutine add_run

   !> All members of another set become members; that set may be defined later.
   subroutine add_reference(self, set, name, place)
      class(set_table_t), intent(inout) :: self
      !> the set that gets them
      integer, intent(in) :: set
      !> the other set's name, in capitals
      character(len=*), intent(in) :: name
      !> where it is named
      type(place_t), intent(in) :: place
      call add_text(self%referred, self%n_references, name)
      call grow(self%referring, self%n_references)
      self%referring(self%n_references) = set
      call put_place(self%reference_place, self%n_references, place)
   end subroutine add_reference

   !> Which set each set's members belong to besides: within(s, t) is true if t = s or t names s, also through
   !> others. A name that no set has is an error.
   subroutine close_table(self, within, diagnostics)
      class(set_table_t), intent(in) :: self
      !> (set, set)
      logical, allocatable, intent(out) :: within(:, :)
      !> errors found
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: i, named, through
      allocate (within(self%n, self%n))
      within = .false.
      do i = 1, self%n
         within(i, i) = .true.
      end do
      do i = 1, self%n_references
         named = self%find(self%referred(i)%s)
         if (named > 0) then
            within(named, self%referring(i)) = .true.
         else
            call diagnostics%error(self%reference_place(i), 'no '//trim(self%kind)//' set '//self%referred(i)%s// &
                                   ' is defined'//self%nearest_name(self%referred(i)%s))
         end if
      end do
      if (self%n_references == 0) return
      do through = 1, self%n ! Warshall's closure
         do i = 1, self%n
            if (within(i, through)) within(i, :) = within(i, :) .or. within(through, :)
         end do
      end do
   end subroutine close_table

   !> The bits of all sets: bit mod(s - 1, 8) of word (s - 1)/8 + 1 says whether an entry belongs to set s.
   pure function membership(self, within, n_entries) result(bits)
      class(set_table_t), intent(in) :: self
      !> of close_table
      logical, intent(in) :: within(:, :)
      !> nodes or elements of the deck
      integer, intent(in) :: n_entries
      integer(i1), allocatable :: bits(:, :)
      integer(i1) :: sets_of(max(1, (self%n + sets_in_a_word - 1)/sets_in_a_word))
      integer :: i, set, entry
      allocate (bits(size(sets_of), n_entries))
      bits = 0_i1
      do i = 1, self%n_runs
         sets_of = 0_i1
         do set = 1, self%n
            if (.not. within(self%run(1, i), set)) cycle
            associate (word => sets_of((set - 1)/sets_in_a_word + 1))
               word = ibset(word, mod(set - 1, sets_in_a_word))
            end associate
         end do
         do entry = self%run(2, i), self%run(3, i)
            bits(:, entry) = ior(bits(:, entry), sets_of)
         end do
      end do
   end function membership

   !> Whether a point lies in a box, its border included.
   pure logical function in_box(point, low, high, margin)
      !> point, lower left and upper right corner [length]
      real(wp), intent(in) :: point(2), low(2), high(2)
      !> how far outside still counts [length]
      real(wp), intent(in) :: margin
      in_box = all(point >= low - margin) .and. all(point <= high + margin)
   end function in_box

   !> Whether a point lies between two circles round a centre, both included.
   pure logical function in_ring(point, centre, inner, outer, margin)
      !> point and centre [length]
      real(wp), intent(in) :: point(2), centre(2)
      !> radii [length]
      real(wp), intent(in) :: inner, outer
      !> how far outside still counts [length]
      real(wp), intent(in) :: margin
      real(wp) :: radius
      radius = norm2(point - centre)
      in_ring = radius >= inner - margin .and. radius <= outer + margin
   end function in_ring

   !> The point nearest to a given one; of those as near within the margin, the one with the lowest id; 0 if none counts.
   pure integer function nearest_point(x, counts, id, point, margin) result(nearest)
      !> points [length], (2, n); which of them count; their ids (the array may be larger)
      real(wp), intent(in) :: x(:, :)
      logical, intent(in) :: counts(:)
      integer, intent(in) :: id(:)
      !> the given place [length]
      real(wp), intent(in) :: point(2)
      !> differences of distance that do not count [length]
      real(wp), intent(in) :: margin
      real(wp) :: least
      integer :: i
      nearest = 0
      least = huge(1.0_wp)
      do i = 1, size(counts)
         if (counts(i)) least = min(least, norm2(x(:, i) - point))
      end do
      do i = 1, size(counts)
         if (.not. counts(i)) cycle
         if (norm2(x(:, i) - point) > least + margin) cycle
         if (nearest == 0) nearest = i
         if (id(i) < id(nearest)) nearest = i
      end do
   end function nearest_point

   !> Store a place in an array that grows.
   subroutine put_place(places, n, place)
      type(place_t), allocatable, intent(inout) :: places(:)
      !> where it goes: just behind those that are there
      integer, intent(in) :: n
      !> where the deck says it
      type(place_t), intent(in) :: place
      type(place_t), allocatable :: larger(:)
      if (.not. allocated(places)) allocate (places(8))
      if (n > size(places)) then
         allocate (larger(n + n/2))
         larger(:n - 1) = places
         call move_alloc(larger, places)
      end if
      places(n) = place
   end subroutine put_place
end module rf_sets
