!> Reads `*CRACK`: cracks that exist from the start. What the surfaces of each are like is read with the materials
!> (rf_material_input); rf_crack_insertion puts them into the mesh.
module rf_crack_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_model
   use rf_deck_rules, only: name_table_t
   use rf_diagnostics, only: place_t
   use rf_grow, only: grow
   implicit none
   private
   public :: crack_t, crack_list_t, crack_fit, crack_edge, crack_element

   !> how a crack gets into the mesh
   integer, parameter :: crack_fit = 1, crack_edge = 2, crack_element = 3

   !> one *CRACK
   type :: crack_t
      !> in capitals, empty if it has none
      character(len=:), allocatable :: name
      !> crack_fit, crack_edge or crack_element
      integer :: splitting = crack_fit
      !> its points in order [length], (2, points)
      real(wp), allocatable :: point(:, :)
      !> where the deck gives it
      type(place_t) :: place
   end type crack_t

   !> all cracks, numbered in the order of the deck
   type :: crack_list_t
      integer :: n = 0
      type(crack_t), allocatable :: crack(:)
      !> to find one by its name
      type(name_table_t) :: names
   contains
      procedure :: read => read_cracks
   end type crack_list_t

contains

   !> Read all cracks.
   subroutine read_cracks(self, deck)
      class(crack_list_t), intent(inout) :: self
      type(deck_t), intent(inout) :: deck
      type(card_t) :: card
      character(len=:), allocatable :: splitting, name
      self%n = 0
      allocate (self%crack(deck%count_of('CRACK') + 1)) ! a described deck has one
      call deck%open(card, 'CRACK', where=in_model, about='a crack that exists from the start, clipped at the body''s '// &
                     'boundary. A *FRICTION behind it belongs to its surfaces')
      do while (deck%next(card))
         self%n = self%n + 1
         call card%get_name('NAME', name, default='', about='name of the crack, by which loads find it')
         call self%names%define(card, 'crack', name)
         call card%get_word('SPLITTING', splitting, allowed='FIT EDGE ELEMENT', default='FIT', &
                            about='FIT: the mesh is fitted, so that the crack lies exactly on the line; EDGE: the line runs '// &
                            'along edges of the mesh, else it is an error; ELEMENT: elements are cut as in a run')
         associate (crack => self%crack(self%n))
            crack%name = name
            crack%place = card%keyword_place()
            if (splitting == 'EDGE') crack%splitting = crack_edge
            if (splitting == 'ELEMENT') crack%splitting = crack_element
            call read_points(card, crack%point)
         end associate
      end do
   end subroutine read_cracks

   !> The points of the polyline, at least two, each another than the one before.
   subroutine read_points(card, point)
      type(card_t), intent(inout) :: card
      !> (2, points)
      real(wp), allocatable, intent(out) :: point(:, :)
      integer :: n
      n = 0
      allocate (point(2, 0))
      if (.not. card%needs_line('x, y')) return
      do
         n = n + 1
         call grow(point, n)
         call card%field_real('x', point(1, n), unit='length', about='point of the crack')
         call card%field_real('y', point(2, n), unit='length', about='point of the crack; two points at least')
         if (n > 1 .and. .not. (card%line_failed .or. card%describing())) then
            if (.not. norm2(point(:, n) - point(:, n - 1)) > 0) call card%error('the point is the one before it')
         end if
         if (.not. card%line()) exit
      end do
      point = point(:, :n)
      if (n < 2) call card%keyword_error('a crack needs two points at least')
   end subroutine read_points

end module rf_crack_input
