# Writes rf_version.f90: what this build is. At build time, so that the commit is the one that is built; the file changes
# only if its text does. Included by src/app/CMakeLists.txt, and run as a script by the target rfem_commit.
function(rfem_write_version template target source_folder)
  set(commit unknown)
  find_package(Git QUIET)
  if(Git_FOUND AND EXISTS ${source_folder}/.git)
    execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty
      WORKING_DIRECTORY ${source_folder} RESULT_VARIABLE failed OUTPUT_VARIABLE described ERROR_QUIET
      OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(NOT failed)
      set(commit ${described})
    endif()
  endif()
  configure_file(${template} ${target} @ONLY)
endfunction()

if(CMAKE_SCRIPT_MODE_FILE)
  rfem_write_version(${TEMPLATE} ${TARGET} ${SOURCE_FOLDER})
endif()
