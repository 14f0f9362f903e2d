# cmake --install BUILD --prefix PREFIX: what leads to this clone (compare/shell/install.py).
execute_process(COMMAND /usr/bin/python3 -I -X utf8 ${CMAKE_CURRENT_LIST_DIR}/../../cases/start.py
                        compare.shell.install $ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}
                COMMAND_ERROR_IS_FATAL ANY)
