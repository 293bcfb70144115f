// The parts of the viewer's page as read-only data (view_page.cpp).
    .macro part name, file
    .global vnreg_page_\name
    .hidden vnreg_page_\name
vnreg_page_\name:
    .incbin "\file"
    .global vnreg_page_\name\()_end
    .hidden vnreg_page_\name\()_end
vnreg_page_\name\()_end:
    .endm

    .section .rodata
    part html, page.html
    part style, style.css
    part three, third_party/three.js
    part script, view.js
    .section .note.GNU-stack, "", %progbits
