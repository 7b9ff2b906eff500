# The commands in Python beside the program: bin/rfem-plot and so on, in the build folder and where rfem is installed.
include(GNUInstallDirs)
foreach(name plot compare collect recover)
  configure_file(${PROJECT_SOURCE_DIR}/postproc/launcher.in ${CMAKE_BINARY_DIR}/launcher/rfem-${name} @ONLY)
  file(COPY ${CMAKE_BINARY_DIR}/launcher/rfem-${name} DESTINATION ${CMAKE_BINARY_DIR}/bin
    FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  install(PROGRAMS ${CMAKE_BINARY_DIR}/launcher/rfem-${name} DESTINATION ${CMAKE_INSTALL_BINDIR})
endforeach()
file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/postproc/rfem_*.py)
install(FILES ${files} ${PROJECT_SOURCE_DIR}/postproc/requirements.txt
  DESTINATION ${CMAKE_INSTALL_DATADIR}/rfem/postproc)
