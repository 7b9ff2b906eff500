!> The bytes of a deck: where lines begin and end, and which characters are special.
module rf_deck_characters
   use rf_text, only: is_blank, to_text
   implicit none
   private
   public :: take_line, character_problem, first_refused, letters, has_zero, has_angle

   !> what is special about a character; a line has the sum of what its characters have
   integer, parameter :: has_foreign = 1, has_control = 2, has_return = 4, has_zero = 8, has_angle = 16
   integer, parameter :: class_of(0:255) = [has_zero, spread(has_control, 1, 8), 0, 0, spread(has_control, 1, 2), has_return, &
      spread(has_control, 1, 18), spread(0, 1, 28), has_angle, spread(0, 1, 66), has_control, spread(has_foreign, 1, 128)]
contains

   !> Next line: first and last character that is not blank, sum of what is special in it.
   subroutine take_line(pool, last, place, start, finish, special)
      character(len=*), intent(in) :: pool
      !> last place of the file
      integer, intent(in) :: last
      !> where the line begins; afterwards: where the next one does
      integer, intent(inout) :: place
      integer, intent(out) :: start, finish, special
      integer :: code, i
      special = 0
      start = place
      do i = place, last
         code = iachar(pool(i:i))
         if (code == 10) exit
         special = ior(special, class_of(iand(code, 255)))
      end do
      place = i + 1
      finish = i - 1
      do while (start <= finish)
         if (.not. is_blank(pool(start:start))) exit
         start = start + 1
      end do
      do while (finish >= start)
         if (.not. is_blank(pool(finish:finish))) exit
         finish = finish - 1
      end do
   end subroutine take_line

   !> Place of the first character that only comments and headings may have; 0 if there is none.
   pure integer function first_refused(text) result(place)
      !> a line
      character(len=*), intent(in) :: text
      do place = 1, len(text)
         if (iand(class_of(iand(iachar(text(place:place)), 255)), has_foreign + has_control + has_return) /= 0) return
      end do
      place = 0
   end function first_refused

   !> What is wrong with a character.
   pure function character_problem(letter, column) result(problem)
      character(len=1), intent(in) :: letter
      !> its place in the line, blanks before it not counted
      integer, intent(in) :: column
      character(len=:), allocatable :: problem
      integer :: code
      code = iand(iachar(letter), 255)
      if (code > 127) then
         problem = 'character '//to_text(column)//' is not ASCII, which is allowed in comments and headings only'
      else if (code == 13) then
         problem = 'a carriage return inside the line: lines must end with LF or CRLF'
      else
         problem = 'character '//to_text(column)//' is a control character (code '//to_text(code)//')'
      end if
   end function character_problem

   !> Characters of a text in UTF-8: bytes that begin one.
   pure integer function letters(text)
      character(len=*), intent(in) :: text
      integer :: i
      letters = 0
      do i = 1, len(text)
         if (iand(iachar(text(i:i)), 192) /= 128) letters = letters + 1
      end do
   end function letters

end module rf_deck_characters
