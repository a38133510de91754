# What Doxygen does not read of the kernel's headers: the inline namespace, defaulted and deleted functions, and a model's types under
# their own names (`using Vec = typename M::Vec`). Lines stay lines.
s/^namespace nscdd \{ inline namespace NSCDD_ABI \{/namespace nscdd {/
s/^\}\}/}/
s/^ *((virtual )?[A-Za-z~]+(& operator=)?\([^()]*\) = (default|delete)|using ([A-Za-z]+) = typename [A-Za-z]+::\5);$//
