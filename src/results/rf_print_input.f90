!> Reads `*NODE PRINT` and `*EL PRINT`: the tables of JOB.dat.
module rf_print_input
   use rf_catalogue, only: catalogue_t
   use rf_deck, only: deck_t, card_t, in_step
   use rf_mesh_input, only: mesh_input_t
   implicit none
   private
   public :: node_print_t, element_print_t, read_node_prints, read_element_prints

   !> a *NODE PRINT
   type :: node_print_t
      !> steps that it holds for: its own, and those after it up to the next that has *NODE PRINT
      integer :: first_step = 0, last_step = 0
      !> number and name of the node set
      integer :: set = 0
      character(len=:), allocatable :: set_name
      !> increments from one table to the next
      integer :: frequency = 1
      !> the deck gives them (dynamic steps have another default)
      logical :: frequency_given = .false.
      !> displacements, reactions
      logical :: displacements = .false., reactions = .false.
      !> a line for each node, the sum of the reactions
      logical :: nodes = .true., totals = .false.
   end type node_print_t

   !> an *EL PRINT
   type :: element_print_t
      !> steps that it holds for: its own, and those after it up to the next that has *EL PRINT
      integer :: first_step = 0, last_step = 0
      !> number and name of the element set
      integer :: set = 0
      character(len=:), allocatable :: set_name
      !> increments from one table to the next
      integer :: frequency = 1
      !> the deck gives them (dynamic steps have another default)
      logical :: frequency_given = .false.
      logical :: stresses = .false., strains = .false.
   end type element_print_t

contains

   !> All blocks of `*NODE PRINT`. A step without it keeps those of the last step, a step with it has its own only.
   subroutine read_node_prints(deck, mesh_input, prints)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(node_print_t), allocatable, intent(out) :: prints(:)
      type(card_t) :: card
      type(node_print_t) :: this
      character(len=:), allocatable :: totals
      integer :: n
      allocate (prints(deck%count_of('NODE PRINT')))
      n = 0
      call deck%open(card, 'NODE PRINT', where=in_step, about='tables of nodes in JOB.dat. A step without it keeps those of '// &
                     'the last step, a step with it has its own only')
      do while (deck%next(card))
         call read_head(card, mesh_input%nodes, 'NSET', this%set_name, this%set, this%frequency, &
                        this%frequency_given)
         call card%get_word('TOTALS', totals, allowed='YES NO ONLY', default='NO', about='the sum of RF too, or only')
         this%nodes = totals /= 'ONLY'
         this%totals = totals /= 'NO'
         call read_words(card, 'U', this%displacements, 'RF', this%reactions, 'U: displacements, RF: reactions')
         this%first_step = card%step
         this%last_step = deck%step_count()
         if (card%describing()) cycle
         where (prints(:n)%first_step < card%step) prints(:n)%last_step = min(prints(:n)%last_step, card%step - 1)
         n = n + 1
         prints(n) = this
      end do
      prints = prints(:n)
   end subroutine read_node_prints

   !> All blocks of `*EL PRINT`. A step without it keeps those of the last step, a step with it has its own only.
   subroutine read_element_prints(deck, mesh_input, prints)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(element_print_t), allocatable, intent(out) :: prints(:)
      type(card_t) :: card
      type(element_print_t) :: this
      character(len=:), allocatable :: totals
      integer :: n
      allocate (prints(deck%count_of('EL PRINT')))
      n = 0
      call deck%open(card, 'EL PRINT', where=in_step, about='tables of elements in JOB.dat. A step without it keeps those of '// &
                     'the last step, a step with it has its own only')
      do while (deck%next(card))
         call read_head(card, mesh_input%elements, 'ELSET', this%set_name, this%set, this%frequency, &
                        this%frequency_given)
         call card%get_word('TOTALS', totals, allowed='YES NO ONLY', default='NO', about='without effect: S and E have no sum')
         call read_words(card, 'S', this%stresses, 'E', this%strains, 'S: stresses, E: strains')
         this%first_step = card%step
         this%last_step = deck%step_count()
         if (card%describing()) cycle
         where (prints(:n)%first_step < card%step) prints(:n)%last_step = min(prints(:n)%last_step, card%step - 1)
         n = n + 1
         prints(n) = this
      end do
      prints = prints(:n)
   end subroutine read_element_prints

   !> Set and frequency.
   subroutine read_head(card, catalogue, parameter, name, set, frequency, given)
      type(card_t), intent(inout) :: card
      type(catalogue_t), intent(in) :: catalogue
      !> NSET or ELSET
      character(len=*), intent(in) :: parameter
      !> the set's name and number (0 after an error)
      character(len=:), allocatable, intent(out) :: name
      integer, intent(out) :: set
      !> increments from one table to the next
      integer, intent(out) :: frequency
      !> the deck gives them
      logical, intent(out) :: given
      character(len=:), allocatable :: problem
      set = 0
      call card%get_name(parameter, name, about='set of '//catalogue%noun()//'s')
      if (len(name) > 0 .and. .not. card%describing()) then
         call catalogue%find_set(name, set, problem)
         if (len(problem) > 0) call card%keyword_error(problem)
      end if
      call card%get_integer('FREQUENCY', frequency, default=1, at_least=1, shown='1; in a dynamic step with each frame', &
                            about='increments from one table to the next; in a dynamic step time steps')
      given = card%given('FREQUENCY')
   end subroutine read_head

   !> The data lines: which of two quantities.
   subroutine read_words(card, first_word, first, second_word, second, about)
      type(card_t), intent(inout) :: card
      !> the words
      character(len=*), intent(in) :: first_word, second_word
      !> whether they are asked for
      logical, intent(out) :: first, second
      character(len=*), intent(in) :: about
      character(len=:), allocatable :: word
      integer :: i
      first = .false.
      second = .false.
      if (.not. card%needs_line(first_word//', '//second_word)) return
      do
         do i = 1, card%fields()
            call card%field_word('quantity', word, allowed=first_word//' '//second_word, about=about)
            first = first .or. word == first_word
            second = second .or. word == second_word
         end do
         if (.not. card%line()) exit
      end do
   end subroutine read_words
end module rf_print_input
