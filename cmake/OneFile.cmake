# Makes spindle one file that needs nothing but the C library: loading the others is a quarter of a short
# run (bench/README.md). Where they cannot be had as static libraries, it stays as it is.
set(SPINDLE_FMT fmt::fmt)
set(SPINDLE_YAML PkgConfig::YAML)
set(SPINDLE_SQLITE PkgConfig::SQLITE)
set(SPINDLE_MODBUS PkgConfig::MODBUS)
set(SPINDLE_LINK_OPTIONS "")
if(NOT SPINDLE_ONE_FILE OR SPINDLE_SANITIZE)
  return()
endif()

find_library(SPINDLE_STATIC_LIBYAML libyaml.a)
find_library(SPINDLE_STATIC_SQLITE libsqlite3.a)
if(SPINDLE_STATIC_LIBYAML AND SPINDLE_STATIC_SQLITE AND fmt_VERSION VERSION_GREATER_EQUAL 9 AND fmt_VERSION VERSION_LESS 10)
  add_library(spindle_fmt STATIC ${CMAKE_CURRENT_LIST_DIR}/fmt.cpp)
  target_include_directories(spindle_fmt SYSTEM PUBLIC
    $<TARGET_PROPERTY:fmt::fmt,INTERFACE_INCLUDE_DIRECTORIES>)
  set(SPINDLE_FMT spindle_fmt)
  set(SPINDLE_YAML ${SPINDLE_STATIC_LIBYAML})
  set(SPINDLE_SQLITE ${SPINDLE_STATIC_SQLITE} m ${CMAKE_DL_LIBS} Threads::Threads)
  set(SPINDLE_LINK_OPTIONS -static-libstdc++ -static-libgcc -Wl,--gc-sections)
endif()

# Debian has no static libmodbus; only its header is used.
if(SPINDLE_STATIC)
  if(NOT TARGET spindle_fmt)
    message(FATAL_ERROR "a static program needs libyaml.a, libsqlite3.a and fmt 9")
  endif()
  add_library(spindle_serial_port STATIC ${CMAKE_CURRENT_LIST_DIR}/serial_port.cpp)
  target_include_directories(spindle_serial_port SYSTEM PUBLIC ${MODBUS_INCLUDE_DIRS})
  set(SPINDLE_MODBUS spindle_serial_port)
  set(SPINDLE_LINK_OPTIONS -static -Wl,--gc-sections)
endif()
