!> Text: case, blanks, lists of words, the nearest word, numbers as text.
module rf_text
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use rf_kinds, only: wp, i8
   implicit none
   private
   public :: text_t, upper, lower, squeezed, is_blank, first_filled, last_filled, split, joined, has_word, same_text
   public :: nearest_word, did_you_mean, add_text, to_text, file_stem, file_folder

   character(len=1), parameter :: tab = achar(9)
   !> words longer than this are not compared letter by letter
   integer, parameter :: longest_compared = 60

   !> a text with a length of its own, for arrays of texts
   type :: text_t
      character(len=:), allocatable :: s
   end type text_t

   !> a number as text: the shortest that reads back as the same number
   interface to_text
      module procedure integer_text, long_text, real_text
   end interface to_text

   !> split a list into its words
   interface split
      module procedure split_list
   end interface split

contains

   !> Letters a-z made capital; everything else, also non-ASCII, is kept.
   pure function upper(text) result(changed)
      !> any text
      character(len=*), intent(in) :: text
      character(len=len(text)) :: changed
      integer :: i
      do i = 1, len(text)
         changed(i:i) = text(i:i)
         if (text(i:i) >= 'a' .and. text(i:i) <= 'z') changed(i:i) = achar(iachar(text(i:i)) - 32)
      end do
   end function upper

   !> Letters A-Z made small.
   pure function lower(text) result(changed)
      !> any text
      character(len=*), intent(in) :: text
      character(len=len(text)) :: changed
      integer :: i
      do i = 1, len(text)
         changed(i:i) = text(i:i)
         if (text(i:i) >= 'A' .and. text(i:i) <= 'Z') changed(i:i) = achar(iachar(text(i:i)) + 32)
      end do
   end function lower

   !> A blank, a tab or a carriage return.
   pure logical function is_blank(letter)
      !> one character
      character(len=1), intent(in) :: letter
      is_blank = letter == ' ' .or. letter == tab .or. letter == achar(13)
   end function is_blank

   !> Place of the first character that is not blank; len(text) + 1 if all are.
   pure integer function first_filled(text) result(place)
      !> any text
      character(len=*), intent(in) :: text
      do place = 1, len(text)
         if (.not. is_blank(text(place:place))) return
      end do
   end function first_filled

   !> Place of the last character that is not blank; 0 if all are.
   pure integer function last_filled(text) result(place)
      !> any text
      character(len=*), intent(in) :: text
      do place = len(text), 1, -1
         if (.not. is_blank(text(place:place))) return
      end do
   end function last_filled

   !> Without blanks at both ends, and with each run of blanks and tabs inside made one blank.
   pure function squeezed(text) result(short)
      !> any text
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: short
      character(len=len(text)) :: buffer
      integer :: i, n
      logical :: gap
      n = 0
      gap = .false.
      do i = 1, len(text)
         if (is_blank(text(i:i))) then
            gap = n > 0
         else
            if (gap) then
               n = n + 1
               buffer(n:n) = ' '
               gap = .false.
            end if
            n = n + 1
            buffer(n:n) = text(i:i)
         end if
      end do
      short = buffer(:n)
   end function squeezed

   !> The words of a list, separated by commas if it has any, else by blanks.
   pure subroutine split_list(list, words)
      !> the list
      character(len=*), intent(in) :: list
      !> its words without blanks round them
      type(text_t), allocatable, intent(out) :: words(:)
      character(len=:), allocatable :: rest
      character(len=1) :: separator
      integer :: n, cut
      rest = squeezed(list)
      separator = merge(',', ' ', index(rest, ',') > 0)
      n = 0
      if (len(rest) > 0) n = 1
      do cut = 1, len(rest)
         if (rest(cut:cut) == separator) n = n + 1
      end do
      allocate (words(n))
      do n = 1, size(words)
         cut = index(rest, separator)
         if (cut == 0) cut = len(rest) + 1
         words(n)%s = squeezed(rest(:cut - 1))
         rest = rest(min(cut + 1, len(rest) + 1):)
      end do
   end subroutine split_list

   !> All words in one text.
   pure function joined(words, separator) result(text)
      !> the words
      type(text_t), intent(in) :: words(:)
      !> stands between two of them
      character(len=*), intent(in) :: separator
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(words)
         if (i > 1) text = text//separator
         text = text//words(i)%s
      end do
   end function joined

   !> Whether a word stands in a list of words separated by commas or blanks.
   pure logical function has_word(list, word)
      !> the list
      character(len=*), intent(in) :: list
      !> the word
      character(len=*), intent(in) :: word
      type(text_t), allocatable :: words(:)
      integer :: i
      call split_list(list, words)
      has_word = .false.
      do i = 1, size(words)
         if (same_text(words(i)%s, word)) has_word = .true.
      end do
   end function has_word

   !> Equal also in length (Fortran's == ignores blanks at the end).
   pure logical function same_text(a, b)
      !> the two texts
      character(len=*), intent(in) :: a, b
      same_text = len(a) == len(b)
      if (same_text) same_text = a == b
   end function same_text

   !> Append a text to an array of texts, which grows in steps of half its size.
   pure subroutine add_text(texts, n, text)
      !> the array; entries beyond n are free
      type(text_t), allocatable, intent(inout) :: texts(:)
      !> texts in use, one more afterwards
      integer, intent(inout) :: n
      !> the new one
      character(len=*), intent(in) :: text
      type(text_t), allocatable :: larger(:)
      integer :: i
      if (.not. allocated(texts)) allocate (texts(8))
      if (n == size(texts)) then
         allocate (larger(n + max(8, n/2)))
         do i = 1, n
            call move_alloc(texts(i)%s, larger(i)%s)
         end do
         call move_alloc(larger, texts)
      end if
      n = n + 1
      texts(n)%s = text
   end subroutine add_text

   !> The candidate nearest to a word by letters changed, left out, added or swapped; empty if none is near.
   !> Distance: Damerau and Levenshtein, optimal string alignment; near means at most a third of the letters.
   pure function nearest_word(word, candidates) result(best)
      !> what was written
      character(len=*), intent(in) :: word
      !> what is known
      type(text_t), intent(in) :: candidates(:)
      character(len=:), allocatable :: best
      integer :: i, distance, least
      best = ''
      least = min(max(1, (len(word) + 1)/3), len(word) - 1) + 1
      do i = 1, size(candidates)
         if (.not. allocated(candidates(i)%s)) cycle
         if (abs(len(candidates(i)%s) - len(word)) >= least) cycle
         distance = letters_apart(upper(word), upper(candidates(i)%s))
         if (distance < least) then
            least = distance
            best = candidates(i)%s
         end if
      end do
   end function nearest_word

   !> '; did you mean X?' or nothing, to end an error with.
   pure function did_you_mean(word, candidates, prefix) result(text)
      !> what was written
      character(len=*), intent(in) :: word
      !> what is known
      type(text_t), intent(in) :: candidates(:)
      !> stands before the word found (the star of a keyword)
      character(len=*), intent(in), optional :: prefix
      character(len=:), allocatable :: text
      text = nearest_word(word, candidates)
      if (len(text) == 0) return
      if (present(prefix)) text = prefix//text
      text = '; did you mean '//text//'?'
   end function did_you_mean

   !> Least number of letters to change, leave out, add or swap with their neighbour to come from a to b.
   pure integer function letters_apart(a, b) result(distance)
      !> the two words
      character(len=*), intent(in) :: a, b
      integer :: d(-1:longest_compared, -1:longest_compared), i, j, m, n
      m = min(len(a), longest_compared)
      n = min(len(b), longest_compared)
      d = 2*longest_compared ! row and column -1 are never the least
      d(0:, 0) = [(i, i=0, longest_compared)]
      d(0, 0:) = [(i, i=0, longest_compared)]
      do j = 1, n
         do i = 1, m
            d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
            if (swapped(a(:i), b(:j))) d(i, j) = min(d(i, j), d(i - 2, j - 2) + 1)
         end do
      end do
      distance = d(m, n)
   end function letters_apart

   !> Whether the last two letters of a are those of b the other way round.
   pure logical function swapped(a, b)
      !> beginnings of two words
      character(len=*), intent(in) :: a, b
      integer :: i, j
      i = len(a)
      j = len(b)
      swapped = .false.
      if (i > 1 .and. j > 1) swapped = a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)
   end function swapped

   pure function integer_text(value) result(text)
      integer, intent(in) :: value
      character(len=:), allocatable :: text
      text = long_text(int(value, i8))
   end function integer_text

   pure function long_text(value) result(text)
      integer(i8), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(i0)') value
      text = trim(buffer)
   end function long_text

   !> Shortest decimal that reads back as the same number (15 digits if they suffice, else 16 or 17).
   pure function real_text(value) result(text)
      !> any number
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      character(len=12) :: form
      real(wp) :: back
      integer :: digits, status
      if (ieee_is_nan(value)) then
         text = 'NaN'
      else if (abs(value) > huge(value)) then
         text = trim(merge('Infinity ', '-Infinity', value > 0))
      else
         do digits = 15, 17
            write (form, '(a,i0,a)') '(es32.', digits - 1, 'e4)'
            write (buffer, form) value
            if (abs(value) > 1.0e308_wp) cycle ! what was rounded up might not be readable
            read (buffer, *, iostat=status) back
            if (status == 0 .and. transfer(back, 0_i8) == transfer(value, 0_i8)) exit
         end do
         text = plain_decimal(trim(adjustl(buffer)))
      end if
   end function real_text

   !> '1.250000E-0003' -> '0.00125', '2.74E+0010' -> '2.74E10'
   pure function plain_decimal(scientific) result(text)
      !> sign, one digit, point, digits, E, exponent
      character(len=*), intent(in) :: scientific
      character(len=:), allocatable :: text
      character(len=:), allocatable :: digits, minus
      integer :: mark, exponent, n
      mark = index(scientific, 'E')
      read (scientific(mark + 1:), *) exponent
      minus = ''
      if (scientific(1:1) == '-') minus = '-'
      n = len(minus)
      digits = scientific(n + 1:n + 1)//scientific(n + 3:mark - 1)
      do n = len(digits), 2, -1
         if (digits(n:n) /= '0') exit
      end do
      digits = digits(:max(n, 1))
      n = len(digits)
      if (exponent >= 0 .and. exponent <= 6 .and. n <= exponent + 1) then
         text = digits//repeat('0', exponent + 1 - n)
      else if (exponent >= 0 .and. exponent <= 6) then
         text = digits(:exponent + 1)//'.'//digits(exponent + 2:)
      else if (exponent < 0 .and. exponent >= -4) then
         text = '0.'//repeat('0', -exponent - 1)//digits
      else
         text = digits(1:1)
         if (n > 1) text = text//'.'//digits(2:)
         text = text//'E'//integer_text(exponent)
      end if
      text = minus//text
   end function plain_decimal

   !> 'decks/case.inp' -> 'case': the file's name without folder and last extension.
   pure function file_stem(path) result(stem)
      !> path of a file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: stem
      integer :: dot
      stem = path(index(path, '/', back=.true.) + 1:)
      dot = index(stem, '.', back=.true.)
      if (dot > 1) stem = stem(:dot - 1)
   end function file_stem

   !> 'decks/case.inp' -> 'decks/'; empty for a file of the working directory.
   pure function file_folder(path) result(folder)
      !> path of a file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: folder
      folder = path(:index(path, '/', back=.true.))
   end function file_folder

end module rf_text
