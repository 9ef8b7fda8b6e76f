# Where Debian expects what (policy 9.1, 9.3, 12.1, 12.3, 12.5, 12.7), and two packages of it: cpack -G DEB.
# spindle is the program with its recorder; spindle-gateway is what needs the libraries of brokers, databases and
# browsers.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME spindle)
set(doc_folder ${CMAKE_INSTALL_DATADIR}/doc/spindle)
set(unit_folder lib/systemd/system)
set(folder_permissions OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS ${folder_permissions})

install(TARGETS spindle RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS spindle-forward spindle-serve RUNTIME DESTINATION libexec/spindle COMPONENT gateway)
install(FILES packaging/systemd/spindle-record.service DESTINATION ${unit_folder})
install(FILES packaging/systemd/spindle-forward@.service packaging/systemd/spindle-serve.service
  DESTINATION ${unit_folder} COMPONENT gateway)
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
install(FILES packaging/copyright DESTINATION ${doc_folder}-gateway COMPONENT gateway)
install(DIRECTORY man/examples DESTINATION ${doc_folder})
install(FILES docs/promises.md DESTINATION ${doc_folder})
install(FILES packaging/lintian-overrides
  DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME spindle)
install(FILES packaging/lintian-overrides-gateway
  DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME spindle-gateway COMPONENT gateway)

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
  install(FILES ${compressed} DESTINATION ${destination} ${ARGN})
endfunction()

find_program(GZIP gzip REQUIRED)
spindle_install_compressed(${PROJECT_SOURCE_DIR}/CHANGELOG.md changelog ${doc_folder})
spindle_install_compressed(${PROJECT_BINARY_DIR}/packaging/changelog.Debian changelog.Debian ${doc_folder})
foreach(name IN ITEMS changelog changelog.Debian)
  install(FILES ${PROJECT_BINARY_DIR}/packaging/${name}.gz DESTINATION ${doc_folder}-gateway COMPONENT gateway)
endforeach()
file(GLOB manual_pages CONFIGURE_DEPENDS man/*.[1-9])
foreach(page IN LISTS manual_pages)
  get_filename_component(name ${page} NAME)
  string(REGEX MATCH "[1-9]$" section ${name})
  spindle_install_compressed(${page} ${name} ${CMAKE_INSTALL_MANDIR}/man${section})
endforeach()
get_property(compressed_files GLOBAL PROPERTY SPINDLE_COMPRESSED)
add_custom_target(spindle_documents ALL DEPENDS ${compressed_files})

# Maintainer scripts, as debhelper makes them for units that a package does not enable.
# RUNNING_UNITS: what is run anew; an instance of a template is enabled by its administrator alone.
function(spindle_maintainer_scripts component UNIT_FILES RUNNING_UNITS)
  set(scripts)
  foreach(script IN ITEMS postinst prerm postrm)
    set(made ${PROJECT_BINARY_DIR}/packaging/${component}/${script})
    configure_file(packaging/debian/${script}.in ${made} @ONLY
      FILE_PERMISSIONS ${folder_permissions})
    list(APPEND scripts ${made})
  endforeach()
  string(TOUPPER ${component} name)
  set(CPACK_DEBIAN_${name}_PACKAGE_CONTROL_EXTRA "${scripts}" PARENT_SCOPE)
endfunction()
spindle_maintainer_scripts(spindle spindle-record.service spindle-record.service)
spindle_maintainer_scripts(gateway spindle-serve.service "spindle-serve.service 'spindle-forward@*.service'")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME spindle)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${SPINDLE_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS ${folder_permissions})
set(CPACK_COMPONENTS_ALL spindle gateway)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_SPINDLE_PACKAGE_NAME spindle)
set(CPACK_DEBIAN_SPINDLE_PACKAGE_SECTION utils)
set(CPACK_DEBIAN_SPINDLE_PACKAGE_SUGGESTS spindle-gateway)
set(CPACK_DEBIAN_SPINDLE_DESCRIPTION
"operator tool for screwdrivers and motor drivers that speak Modbus
Identifies, reads, sets, watches, starts, backs up and restores industrial
tools that turn: DOGA/HANTAS BM and BMT wireless screwdrivers over Modbus TCP,
and Oriental Motor BLV brushless motor drivers over Modbus RTU.
.
People read its tables, scripts its JSON lines and exit statuses. Results are
recorded by a service, which the package does not enable. A simulated tool is
built in. This is not a safety device.")
set(CPACK_DEBIAN_GATEWAY_PACKAGE_NAME spindle-gateway)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_SECTION net)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_DEPENDS "spindle (= ${SPINDLE_PACKAGE_VERSION})")
set(CPACK_DEBIAN_GATEWAY_DESCRIPTION
"hands results of spindle on to PostgreSQL and MQTT, and shows them as a page
What 'spindle record' has stored is delivered to a PostgreSQL database, where
every result arrives exactly once, and to an MQTT 5 broker for those who
listen now. A read-only page in a browser shows the tools of a line.
.
The programs run behind 'spindle forward' and 'spindle serve', or as services,
which the package does not enable.")
include(CPack)
