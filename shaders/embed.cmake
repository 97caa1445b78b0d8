# cmake -DSPIRV=FILE -DOUT=FILE -P embed.cmake: a SPIR-V file's words as the initialiser of a C array.
file(READ ${SPIRV} hex HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${hex}")
file(WRITE ${OUT} "{${words}}\n")
