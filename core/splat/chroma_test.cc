int placeholder_for_chroma_test = 0;
