!> Who is called what: the ids and set names by which a deck speaks of nodes, or of elements. One catalogue for each.
module rf_catalogue
   use rf_kinds, only: i8
   use rf_id_map, only: id_map_t
   use rf_mesh, only: mesh_t
   use rf_number, only: read_integer, number_ok, number_overflow
   use rf_numbering, only: order_by_key
   use rf_sets, only: set_table_t
   use rf_text, only: squeezed, to_text, upper
   implicit none
   private
   public :: catalogue_t, selection_t

   !> what a field 'id or set' means: a set or a single node or element; neither if it was wrong
   type :: selection_t
      !> number of the set (mesh%node_in_set, mesh%element_in_set)
      integer :: set = 0
      !> internal number of the node or element
      integer :: single = 0
   end type selection_t

   type :: catalogue_t
      !> it lists elements (else nodes)
      logical :: of_elements = .false.
      !> entries, in the order of the deck
      type(id_map_t) :: ids
      type(set_table_t) :: sets
      !> internal number of each entry (0: left out of the mesh)
      integer, allocatable :: place(:)
      !> members of each set at the start
      integer, allocatable :: n_members(:)
      !> the mesh was not read without errors: that something is not there means nothing, and is no problem
      logical :: incomplete = .false.
   contains
      procedure :: find, find_set, resolve, members, selected, forget_ids, noun
   end type catalogue_t

contains

   !> Internal number of the node or element of an id; 0 if there is none in the mesh.
   pure integer function find(self, id) result(number)
      class(catalogue_t), intent(in) :: self
      !> the deck's id
      integer, intent(in) :: id
      number = self%ids%find(id)
      if (number > 0) number = self%place(number)
   end function find

   !> Number of the set of a name that must have members.
   pure subroutine find_set(self, name, set, problem)
      class(catalogue_t), intent(in) :: self
      !> the name as written
      character(len=*), intent(in) :: name
      !> its number; 0 if there is a problem
      integer, intent(out) :: set
      !> what is wrong; empty if nothing is
      character(len=:), allocatable, intent(out) :: problem
      character(len=:), allocatable :: known
      known = upper(squeezed(name))
      set = self%sets%find(known)
      problem = ''
      if (set == 0) then
         problem = 'no '//self%noun()//' set '//known//' is defined'//self%sets%nearest_name(known)
      else if (allocated(self%n_members)) then
         if (self%n_members(set) > 0) return
         problem = self%noun()//' set '//known//' has no members in the mesh (ids that are not defined, '
         if (self%of_elements) problem = problem//'line elements are left out)'
         if (.not. self%of_elements) problem = problem//'nodes on no element are left out)'
         if (self%incomplete) problem = ''
         set = 0
      end if
   end subroutine find_set

   !> What a field 'id or set name' means.
   pure subroutine resolve(self, text, selection, problem)
      class(catalogue_t), intent(in) :: self
      !> the field
      character(len=*), intent(in) :: text
      !> the set or the single node or element; neither if there is a problem
      type(selection_t), intent(out) :: selection
      !> what is wrong; empty if nothing is
      character(len=:), allocatable, intent(out) :: problem
      integer :: id, status
      call read_integer(squeezed(text), id, status)
      problem = ''
      if (status == number_overflow) then
         problem = 'no '//self%noun()//' has an id as large as '//squeezed(text)
      else if (status == number_ok) then
         selection%single = self%find(id)
         if (selection%single > 0) return
         if (self%incomplete) return
         problem = 'no '//self%noun()//' '//to_text(id)//' is defined'
         if (self%ids%find(id) == 0) return
         problem = 'node '//to_text(id)//' is on no element'
         if (self%of_elements) problem = 'element '//to_text(id)//' is a line element, which is left out'
      else
         call self%find_set(text, selection%set, problem)
      end if
   end subroutine resolve

   !> The present members of a set in order of output: also copies and children that came by splitting.
   pure function members(self, mesh, set) result(list)
      class(catalogue_t), intent(in) :: self
      !> the mesh
      type(mesh_t), intent(in) :: mesh
      !> number of the set (0: no members)
      integer, intent(in) :: set
      integer, allocatable :: list(:)
      integer, allocatable :: rank(:)
      integer :: i, n, pass
      do pass = 1, 2
         n = 0
         do i = 1, merge(mesh%n_elements, mesh%n_nodes, self%of_elements)
            if (self%of_elements) then
               if (.not. mesh%element_in_set(i, set)) cycle
            else
               if (.not. mesh%node_in_set(i, set)) cycle
            end if
            n = n + 1
            if (pass == 2) list(n) = i
         end do
         if (pass == 1) allocate (list(n))
      end do
      allocate (rank(n))
      if (self%of_elements) rank = mesh%element_rank(list)
      if (.not. self%of_elements) rank = mesh%node_rank(list)
      list = list(order_by_key(int(rank, i8)))
   end function members

   !> The present members of a selection in order of output.
   pure function selected(self, mesh, selection) result(list)
      class(catalogue_t), intent(in) :: self
      !> the mesh
      type(mesh_t), intent(in) :: mesh
      !> of resolve
      type(selection_t), intent(in) :: selection
      integer, allocatable :: list(:)
      if (selection%single > 0) then
         list = [selection%single]
      else
         list = self%members(mesh, selection%set)
      end if
   end function selected

   !> Give back the memory of the ids: nothing can be found by id any more (sets stay).
   subroutine forget_ids(self)
      class(catalogue_t), intent(inout) :: self
      type(id_map_t) :: empty
      self%ids = empty
      if (allocated(self%place)) deallocate (self%place)
   end subroutine forget_ids

   !> 'node' or 'element'.
   pure function noun(self)
      class(catalogue_t), intent(in) :: self
      character(len=:), allocatable :: noun
      noun = 'node'
      if (self%of_elements) noun = 'element'
   end function noun
end module rf_catalogue
