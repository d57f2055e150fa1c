//! The Altivar 312 a second time, from the texts of its manuals and not from the driver: its registers as the variables
//! manual BBV51701 06/2009 lists them, the bits and codes, and every frame that the Modbus manual BBV52816 04/2009 prints.

mod frames;
mod registers;
mod words;
