!> The files of a deck: reading them into the pool, with an error that says what is wrong with one.
module rf_deck_files
   use rf_deck_store, only: store_t, file_t, pool_append
   use rf_diagnostics, only: place_t
   use rf_stream, only: last_reason
   use rf_system, only: is_pipe, read_whole, real_path, read_ok, read_missing, read_folder, read_refused, read_too_large, &
      read_unreachable, largest_file
   use rf_text, only: same_text, to_text
   implicit none
   private
   public :: add_file, enter_file, refuse_loop

   !> most files in a deck: whoever has more has files that include each other without end
   integer, parameter :: most_files = 1000

   !> how HDF5 files begin; how checkpoints end (rf_checkpoint)
   character(len=*), parameter :: hdf5_signature = achar(137)//'HDF'//achar(13)//achar(10)//achar(26)//achar(10), &
      seal_words = 'rfem checkpoint ends here'
   integer, parameter :: longest_seal = 100

contains

   !> Read a file into the pool; says what is wrong if it cannot be read.
   subroutine add_file(store, path, name, parent, done, place)
      type(store_t), intent(inout) :: store
      !> where it lies; what messages call it
      character(len=*), intent(in) :: path, name
      !> file that includes it (0: none)
      integer, intent(in) :: parent
      logical, intent(out) :: done
      !> the *INCLUDE
      type(place_t), intent(in), optional :: place
      character(len=:), allocatable :: text, what
      type(place_t) :: at
      integer :: status
      what = 'the deck '//name
      if (present(place)) then
         at = place
         what = 'the included file '//name
      end if
      done = .false.
      if (present(place) .and. is_pipe(path)) then        ! reading it might wait for ever
         call store%diagnostics%error(at, what//' is a pipe, which a deck cannot include')
         return
      end if
      call read_whole(path, text, status)
      if (status == read_missing) then
         call store%diagnostics%error(at, what//' does not exist')
      else if (status == read_unreachable) then
         call store%diagnostics%error(at, what//' cannot be reached: '//last_reason())
      else if (status == read_folder) then
         call store%diagnostics%error(at, what//' is a folder')
      else if (status == read_too_large .or. int(len(text)) > largest_file - store%pool_used) then
         call store%diagnostics%error(at, what//' is too large: at most '//to_text(largest_file)//' bytes can be read')
      else if (status /= read_ok) then
         call store%diagnostics%error(at, what//trim(merge(': no permission to read it', ': reading failed          ', &
            status == read_refused)))
         store%diagnostics%reading_failed = .true.
      else if (index(text, hdf5_signature) == 1) then
         if (index(text(max(1, len(text) - longest_seal):), seal_words) > 0) then
            call store%diagnostics%error(at, what//' is a checkpoint, to go on from: rfem --restart '//name)
         else
            call store%diagnostics%error(at, what//' is an HDF5 file')
         end if
      else
         done = .true.
         call enter_file(store, text, name, real_path(path), parent)
      end if
   end subroutine add_file

   !> Append a file's text to the pool and the file to the list.
   subroutine enter_file(store, text, name, path, parent)
      type(store_t), intent(inout) :: store
      !> its bytes; used up
      character(len=:), allocatable, intent(inout) :: text
      !> as messages call it; absolute path
      character(len=*), intent(in) :: name, path
      integer, intent(in) :: parent
      type(file_t), allocatable :: larger(:)
      integer :: n, first, last
      if (allocated(store%pool)) then
         call pool_append(store, text, first, last)
      else ! the first file, which may be large, is not copied
         first = 1
         last = len(text)
         store%pool_used = last
         call move_alloc(text, store%pool)
      end if
      n = store%n_files
      if (.not. allocated(store%files)) allocate (store%files(4))
      if (n == size(store%files)) then
         allocate (larger(2*n))
         larger(:n) = store%files
         call move_alloc(larger, store%files)
      end if
      n = n + 1
      store%n_files = n
      store%files(n)%name = name
      store%files(n)%real_path = path
      store%files(n)%parent = parent
      store%files(n)%first = first
      store%files(n)%last = last
   end subroutine enter_file

   !> An *INCLUDE of a file that is being read, or of one too many, is an error.
   subroutine refuse_loop(store, place, including, path, allowed)
      type(store_t), intent(inout) :: store
      !> the *INCLUDE
      type(place_t), intent(in) :: place
      !> file that it stands in
      integer, intent(in) :: including
      character(len=*), intent(in) :: path
      logical, intent(out) :: allowed
      character(len=:), allocatable :: resolved
      integer :: file
      resolved = real_path(path)
      allowed = .false.
      file = including
      do while (file > 0)
         if (same_text(store%files(file)%real_path, resolved)) then
            call store%diagnostics%error(place, '*INCLUDE of '//path//' is a loop: that file is being read')
            return
         end if
         file = store%files(file)%parent
      end do
      allowed = store%n_files < most_files
      if (.not. allowed) call store%diagnostics%error(place, &
         'more than '//to_text(most_files)//' files in one deck')
   end subroutine refuse_loop

end module rf_deck_files
