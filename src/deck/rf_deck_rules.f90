!> Rules that readers of several keywords share: a thing has a name of its own, a keyword stands once in a step.
module rf_deck_rules
   use rf_deck, only: deck_t, card_t
   use rf_text, only: text_t, add_text, did_you_mean, nearest_word, same_text, to_text
   implicit none
   private
   public :: name_table_t, name_length, check_single, any_failed, may_be_misspelt

   !> longest name of a thing [characters]
   integer, parameter :: name_length = 80

   !> names of things of one kind, numbered as they come
   type :: name_table_t
      integer :: n = 0
      type(text_t), allocatable :: name(:)
   contains
      procedure :: define, find, unknown
   end type name_table_t

contains

   !> Name the next thing. A name that another has, or a long one, is an error; the thing is counted all the same.
   subroutine define(self, card, noun, name)
      class(name_table_t), intent(inout) :: self
      !> gets the error
      type(card_t), intent(inout) :: card
      !> 'material'; its name, in capitals
      character(len=*), intent(in) :: noun, name
      if (len(name) > name_length) then
         call card%keyword_error('the name of a '//noun//' can have '//to_text(name_length)//' characters, not '// &
                                 to_text(len(name)))
      else if (self%find(name) > 0 .and. len(name) > 0) then
         call card%keyword_error(noun//' '//name//' is defined already')
      end if
      call add_text(self%name, self%n, name)
   end subroutine define

   !> Number of the thing of a name (the first of them); 0 if there is none.
   pure integer function find(self, name) result(number)
      class(name_table_t), intent(in) :: self
      !> in capitals
      character(len=*), intent(in) :: name
      integer :: i
      number = 0
      do i = self%n, 1, -1
         if (same_text(self%name(i)%s, name)) number = i
      end do
   end function find

   !> 'no material X is defined; did you mean Y?'
   pure function unknown(self, noun, name) result(text)
      class(name_table_t), intent(in) :: self
      !> 'material'; what was written
      character(len=*), intent(in) :: noun, name
      character(len=:), allocatable :: text
      text = 'no '//noun//' '//name//' is defined'
      if (self%n > 0) text = text//did_you_mean(name, self%name(:self%n))
   end function unknown

   !> A keyword that may stand once in a step.
   subroutine check_single(card, last_step)
      !> gets the error
      type(card_t), intent(inout) :: card
      !> step of the block before (start with 0); that of this one
      integer, intent(inout) :: last_step
      if (card%step == last_step) call card%keyword_error('*'//card%keyword()//' stands twice in this step')
      last_step = card%step
   end subroutine check_single

   !> Whether a block of a keyword had an error while it was read.
   logical function any_failed(deck, keyword, where)
      type(deck_t), intent(inout) :: deck
      !> without the star
      character(len=*), intent(in) :: keyword
      !> in_model, in_step or in_both, as its readers have opened it
      integer, intent(in) :: where
      type(card_t) :: card
      any_failed = .false.
      if (deck%describing() .or. deck%count_of(keyword) == 0) return
      call deck%open(card, keyword, where=where)
      do while (deck%next(card))
         any_failed = any_failed .or. card%failed()
      end do
   end function any_failed

   !> Whether the deck has a keyword that nobody has opened and that may be meant to be this one: then the error about
   !> that line says all, and an error about a keyword missing would only confuse.
   logical function may_be_misspelt(card, keyword)
      !> of any keyword
      type(card_t), intent(in) :: card
      !> without the star
      character(len=*), intent(in) :: keyword
      type(text_t) :: candidate(1)
      integer :: k
      may_be_misspelt = .false.
      candidate(1)%s = keyword
      do k = 1, card%store%n_kinds
         associate (kind => card%store%kinds(k))
            if (kind%n_blocks == 0 .or. kind%where > 0) cycle
            if (len(nearest_word(kind%name, candidate)) > 0) may_be_misspelt = .true.
         end associate
      end do
   end function may_be_misspelt
end module rf_deck_rules
