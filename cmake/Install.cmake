# Where Debian expects what (policy 9.1, 12.1, 12.3, 12.5, 12.7), and a package of it: cpack -G DEB.
set(doc_folder ${CMAKE_INSTALL_DATADIR}/doc/spindle)
set(folder_permissions OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS ${folder_permissions})

install(TARGETS spindle RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY profiles/ DESTINATION ${CMAKE_INSTALL_DATADIR}/spindle/profiles FILES_MATCHING PATTERN "*.yaml")
install(FILES share/spindle-1.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/spindle)
install(FILES completions/spindle.bash
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME spindle)
# Debian's zsh looks for what packages bring in another folder than for what was installed by hand.
install(CODE "
  set(zsh_folder site-functions)
  if(CMAKE_INSTALL_PREFIX STREQUAL \"/usr\")
    set(zsh_folder vendor-completions)
  endif()
  file(INSTALL \"${PROJECT_SOURCE_DIR}/completions/_spindle\"
    DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/zsh/\${zsh_folder}\" TYPE FILE)")
install(FILES completions/spindle.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES packaging/copyright DESTINATION ${doc_folder})
install(DIRECTORY man/examples DESTINATION ${doc_folder})
install(FILES packaging/lintian-overrides
  DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME spindle)

# The package's own history; what is new in the program is in the changelog beside it.
file(TIMESTAMP CHANGELOG.md SPINDLE_PACKAGE_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)
set(SPINDLE_MAINTAINER "The spindle authors <spindle@spindle.invalid>")
set(SPINDLE_PACKAGE_VERSION ${PROJECT_VERSION}-1)
configure_file(packaging/changelog.Debian.in packaging/changelog.Debian @ONLY)

# Compressed without a time in it, so that the same source gives the same files.
function(spindle_install_compressed source name destination)
  set(compressed ${PROJECT_BINARY_DIR}/packaging/${name}.gz)
  add_custom_command(OUTPUT ${compressed}
    COMMAND ${GZIP} -9nc ${source} > ${compressed}
    DEPENDS ${source} VERBATIM)
  set_property(GLOBAL APPEND PROPERTY SPINDLE_COMPRESSED ${compressed})
  install(FILES ${compressed} DESTINATION ${destination})
endfunction()

find_program(GZIP gzip REQUIRED)
spindle_install_compressed(${PROJECT_SOURCE_DIR}/CHANGELOG.md changelog ${doc_folder})
spindle_install_compressed(${PROJECT_BINARY_DIR}/packaging/changelog.Debian changelog.Debian ${doc_folder})
file(GLOB manual_pages CONFIGURE_DEPENDS man/*.[1-9])
foreach(page IN LISTS manual_pages)
  get_filename_component(name ${page} NAME)
  string(REGEX MATCH "[1-9]$" section ${name})
  spindle_install_compressed(${page} ${name} ${CMAKE_INSTALL_MANDIR}/man${section})
endforeach()
get_property(compressed_files GLOBAL PROPERTY SPINDLE_COMPRESSED)
add_custom_target(spindle_documents ALL DEPENDS ${compressed_files})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME spindle)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "operator tool for screwdrivers and motor drivers that speak Modbus")
set(CPACK_PACKAGE_DESCRIPTION
"Identifies, reads, sets, watches, starts, backs up and restores industrial
tools that turn: DOGA/HANTAS BM and BMT wireless screwdrivers over Modbus TCP,
and Oriental Motor BLV brushless motor drivers over Modbus RTU.
.
People read its tables, scripts its JSON lines and exit statuses. A simulated
tool is built in. This is not a safety device.")
set(CPACK_PACKAGE_CONTACT "${SPINDLE_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS ${folder_permissions})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION utils)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
