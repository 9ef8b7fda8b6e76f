# Batches of source files: reading and instantiating headers is three quarters of what a file costs, and most files
# read the same ones. cmake/batches.py says what keeps every file's meaning as it is.
find_program(SPINDLE_BATCHES_PYTHON NAMES python3 HINTS /usr/bin)

# Sets `variable` to what is to be compiled instead of the files: KIND is WRAPPED or PROVEN.
function(spindle_batches variable name kind)
  set(${variable} ${ARGN} PARENT_SCOPE)
  if(NOT SPINDLE_UNITY OR NOT SPINDLE_BATCHES_PYTHON)
    return()
  endif()
  set(candidates "")
  set(apart "")
  foreach(source IN LISTS ARGN)
    get_source_file_property(options ${source} COMPILE_OPTIONS)
    if(options)  # its own ones, which a batch would not have
      list(APPEND apart ${source})
    else()
      list(APPEND candidates ${source})
    endif()
  endforeach()
  set(script ${PROJECT_SOURCE_DIR}/cmake/batches.py)
  string(TOLOWER ${kind} kind)
  execute_process(
    COMMAND ${SPINDLE_BATCHES_PYTHON} ${script} --output ${PROJECT_BINARY_DIR}/batches/${name}
      --include ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests --${kind} ${candidates}
    OUTPUT_VARIABLE batches COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB_RECURSE headers ${PROJECT_SOURCE_DIR}/include/*.hpp ${PROJECT_SOURCE_DIR}/src/*.hpp)
  # A file that was changed may have to be alone now.
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${script} ${ARGN} ${headers})
  # g++ takes a batch's files for headers, whose classes must not hold what is private to a file.
  set_source_files_properties(${batches} PROPERTIES COMPILE_OPTIONS $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  set(${variable} ${batches} ${apart} PARENT_SCOPE)
endfunction()
