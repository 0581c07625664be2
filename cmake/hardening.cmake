# What makes an error in memory end the process instead of being used: for every target of every preset, as far as the
# preset can have it. AXISD_HARDENING_PROMISES is what tests/checks/hardening.py looks for in the linked programs.
option(AXISD_HARDENING "Harden the programs against errors in memory" ON)
set(AXISD_HARDENING_PROMISES "")
if(NOT AXISD_HARDENING)
  return()
endif()

# Relocations are done at the start, and their tables are read-only from then on. Functions look at their return address
# before they use it. Programs are loaded at random addresses.
include(CheckPIESupported)
check_pie_supported()
add_compile_options(-fstack-protector-strong)
add_link_options(LINKER:-z,relro,-z,now)
set(AXISD_HARDENING_PROMISES relro now pie stack_protector)

# Checked calls of libc need an optimiser that knows sizes; the sanitizers check these calls themselves.
if(CMAKE_BUILD_TYPE MATCHES "^(Release|RelWithDebInfo|MinSizeRel)$" AND NOT AXISD_SANITIZE)
  add_compile_options(-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=3)
endif()

# Indirect calls land on marked places only, returns go where the call came from: where processor, kernel and libc enforce
# it. Debian 12's start files (crt1.o, crti.o) have no marks, so the linker leaves the note for IBT out, and forcing it
# would promise what _start breaks; for shadow stacks (SHSTK) code needs no marks. The sanitizers' runtimes have neither.
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64" AND NOT AXISD_SANITIZE)
  add_compile_options(-fcf-protection=full)
  add_link_options(LINKER:-z,shstk)
  list(APPEND AXISD_HARDENING_PROMISES landing_pads shstk)
endif()
